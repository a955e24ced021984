// SPDX-License-Identifier: Apache-2.0
/* Reads the text of one block of a program into words. It does not judge what the words mean
   together.

   Ref: ISO 6983-1 (word address, variable block); EIA RS-274-D. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "base/units.h"

#define BLOCK_CODES 6       /* most M words of a block */
#define BLOCK_G_CODES 12    /* most G words: postprocessors begin a program with ten of them */

typedef struct {
    units_number number;
    bool negative;
    uint16_t column;
} word;

typedef struct {
    uint16_t tenths;    /* G38.2 is 382 */
    uint16_t column;
} code_word;

typedef struct {
    uint32_t present;           /* a bit for each letter; bit 0 is A */
    word words[26];             /* by letter; G and M have lists of their own, `:` is O */
    code_word g[BLOCK_G_CODES], m[BLOCK_CODES];
    uint8_t g_count, m_count;
    bool skipped;               /* begins with `/` and block skip is on */
    /* Progress. */
    const char *text;
    uint32_t length, at;
    uint32_t comment;           /* column of the open bracket, 0 outside a comment */
    bool begun;                 /* something other than space has been read */
} block;

#define BLOCK_BIT(letter) (1u << ((letter) - 'A'))
#define BLOCK_WORD(b, letter) (&(b)->words[(letter) - 'A'])

typedef enum { BLOCK_MORE, BLOCK_DONE, BLOCK_FAULT } block_result;

/* `text` must stay until the block is done. */
void block_begin(block *b, const char *text, uint32_t length);

/* Read about `budget` more characters; `skip` is the switch for block skip. */
block_result block_step(block *b, bool skip, uint32_t budget, fault *f);

/* The number of a word that is a name (N O C D S T): a whole number of at most 8 digits. */
static inline uint32_t block_name(const block *b, char letter) {
    return (uint32_t)b->words[letter - 'A'].number.digits;
}

static inline bool block_has(const block *b, char letter) {
    return b->present & BLOCK_BIT(letter);
}
