// SPDX-License-Identifier: Apache-2.0
#include "interp/reader.h"

#define ISO_START 0xa5
#define ISO_END 0x0a
#define ISO_RETURN 0x8d
#define EIA_START 0x0b
#define EIA_END 0x80

/* EIA RS-244 characters by tracks 7 to 1; 0 is not in the code, 1 is read and ignored (upper and
   lower case, which only printers need). The end of block is the only use of track 8. */
static const char EIA[128] = {
    [0x20] = '0', [0x01] = '1', [0x02] = '2', [0x13] = '3', [0x04] = '4', [0x15] = '5',
    [0x16] = '6', [0x07] = '7', [0x08] = '8', [0x19] = '9', [0x61] = 'A', [0x62] = 'B',
    [0x73] = 'C', [0x64] = 'D', [0x75] = 'E', [0x76] = 'F', [0x67] = 'G', [0x68] = 'H',
    [0x79] = 'I', [0x51] = 'J', [0x52] = 'K', [0x43] = 'L', [0x54] = 'M', [0x45] = 'N',
    [0x46] = 'O', [0x57] = 'P', [0x58] = 'Q', [0x49] = 'R', [0x32] = 'S', [0x23] = 'T',
    [0x34] = 'U', [0x25] = 'V', [0x26] = 'W', [0x37] = 'X', [0x38] = 'Y', [0x29] = 'Z',
    [0x31] = '/', [0x70] = '+', [0x40] = '-', [0x6b] = '.', [0x3b] = ',', [0x10] = ' ',
    [0x0b] = '%', [0x3e] = '\t', [0x0e] = '&', [0x1a] = '(', [0x4a] = ')', [0x7f] = READER_DELETED,
    [0x7c] = 1, [0x7a] = 1,
};

static bool odd_parity(uint8_t byte) {
    return 0x6996 >> ((byte ^ byte >> 4) & 15) & 1; /* bit n: parity of n */
}

/* Character of a byte with good ISO parity; 0 is not in the code, 1 is read and ignored. */
static char iso_character(uint8_t byte) {
    char c = byte & 0x7f;
    if (c == '\r' || c == '\0')
        return 1;
    return c >= ' ' || c == '\t' || c == '\n' ? c : 0;
}

void reader_begin(reader *r, bool tv) {
    *r = (reader){.state = READ_LEADER, .tv = tv, .line = 1, .iso_data = true, .eia_data = true};
}

void reader_next(reader *r) {
    r->line++;
    r->column = r->counted = r->length = 0;
}

void reader_stop(reader *r) { r->state = READ_STOPPED; }

static bool no_start(reader *r, fault *f) {
    f->line = 1;
    fault_at(f, FAULT_NO_START, r->leader_bytes,
             "there is no start code (%% or ER, then end of block) before the data");
    reader_stop(r);
    return false;
}

static reader_result leader_byte(reader *r, uint8_t byte, fault *f) {
    r->leader_bytes++;
    bool iso_end = byte == ISO_END, eia_end = byte == EIA_END;
    uint8_t start = iso_end && r->before == ISO_RETURN ? r->before_that : r->before;
    if ((iso_end && start == ISO_START) || (eia_end && start == EIA_START)) {
        r->eia = eia_end;
        r->state = READ_DATA;
        reader_next(r);
        return READER_MORE;
    }
    /* Only from two characters on: one may be a chance pattern in a leader with punched
       lettering. */
    if (r->run >= 2 && ((iso_end && r->iso_data) || (eia_end && r->eia_data))) {
        no_start(r, f);
        return READER_FAULT;
    }
    if (iso_end || eia_end) {
        r->run = 0;
        r->iso_data = r->eia_data = true;
    } else if (byte != 0) {
        r->run++;
        r->iso_data = r->iso_data && !odd_parity(byte) && iso_character(byte);
        r->eia_data = r->eia_data && odd_parity(byte) && byte < 0x80 && EIA[byte];
    }
    r->before_that = r->before;
    r->before = byte;
    return READER_MORE;
}

static reader_result damaged(reader *r, fault *f) {
    f->line = r->line;
    reader_stop(r);
    return READER_FAULT;
}

static reader_result data_byte(reader *r, uint8_t byte, fault *f) {
    r->column++;
    r->counted += byte != 0;
    if (r->eia && byte == 0) {
        fault_at(f, FAULT_BLANK, r->column, "blank tape inside the program");
        return damaged(r, f);
    }
    if (odd_parity(byte) != r->eia) {
        fault_at(f, FAULT_PARITY, r->column, "parity error (TH) in the byte %x", byte);
        return damaged(r, f);
    }
    char c = byte & 0x7f;
    /* The quick way for most characters: printable ISO characters that end nothing. */
    if (!r->eia && (c > '%' || c == ' ') && r->length < READER_BLOCK_SIZE) {
        r->text[r->length++] = c;
        return READER_MORE;
    }
    c = r->eia ? (byte == EIA_END ? '\n' : byte < 0x80 ? EIA[byte] : 0) : iso_character(byte);
    if (c == 0) {
        fault_at(f, FAULT_CODE, r->column, "the byte %x is not a character of the %s code", byte,
                 r->eia ? "EIA" : "ISO");
        return damaged(r, f);
    }
    if (c == '\n') {
        if (r->tv && r->counted % 2) {
            fault_at(f, FAULT_TV, r->column, "odd number of characters in the block (TV)");
            return damaged(r, f);
        }
        return READER_BLOCK;
    }
    if (c == '%') {
        fault_at(f, FAULT_NO_END, r->column, "the program ends without its end word (M02 or M30)");
        return damaged(r, f);
    }
    if (c == 1)
        c = READER_DELETED;
    if (r->length < READER_BLOCK_SIZE) {
        r->text[r->length++] = c;
    } else if (c != READER_DELETED) {
        fault_at(f, FAULT_TOO_LONG, r->column, "the block has more than %u characters",
                 (uint32_t)READER_BLOCK_SIZE);
        return damaged(r, f);
    }
    return READER_MORE;
}

reader_result reader_byte(reader *r, uint8_t byte, fault *f) {
    switch (r->state) {
    case READ_LEADER: return leader_byte(r, byte, f);
    case READ_DATA: return data_byte(r, byte, f);
    default: return READER_ENDED;
    }
}

bool reader_finish(reader *r, fault *f) {
    if (r->state == READ_STOPPED)
        return true;
    if (r->state == READ_LEADER)
        return no_start(r, f);
    f->line = r->line;
    fault_at(f, FAULT_NO_END, r->column + 1, "the tape ends before the end word (M02 or M30)");
    reader_stop(r);
    return false;
}
