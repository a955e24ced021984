// SPDX-License-Identifier: Apache-2.0
// The serial flash memory of the board, and what a power cut leaves in it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "random.hpp"

namespace plant {

// A W25Q128JV in its plain serial mode: 16 MB, pages of 256 bytes, sectors of 4 KiB. Commands:
// identify (9F), read (03), status (05), write enable and disable (06, 04), page program (02),
// sector erase (20), release from power-down (AB). While it is busy it only tells its status. A
// program or an erase needs a write enable before it and begins when the memory is deselected after
// a whole byte; bits of a page only fall, an erase raises all bits of its sector. Times are typical
// ones of its data sheet; the longest are 3 ms and 400 ms.
//
// A power cut in a program leaves the bytes before some byte programmed, of this byte some of the
// bits, and none behind it. One in an erase leaves every bit that should rise risen or not, the more
// of them the later it comes. Assumed: the data sheet says nothing about it.
class Flash {
public:
    static constexpr uint32_t SIZE = 1u << 24, SECTOR = 4096, PAGE = 256;
    static constexpr double PAGE_S = 0.4e-3, SECTOR_S = 45e-3;
    static constexpr unsigned ERASE_UNITS = 64;  // of an erase, for cut_after

    explicit Flash(uint64_t seed) : random_(seed ^ 0xf1a5) {}
    void configure(double clock_hz) { clock_hz_ = clock_hz; }

    // The memory is selected or not; `now` is in clocks.
    void select(bool on, uint64_t now) {
        settle(now);
        if (!on && selected_ && !dead_ && bits_ == 0)
            begin(now);
        selected_ = on;
        bytes_ = bits_ = 0;
        out_ = 0xff;
    }

    // A whole byte; returns the one that comes out meanwhile.
    uint8_t exchange(uint8_t in, uint64_t now) {
        const uint8_t out = out_;
        out_ = selected_ && !dead_ ? take(in, now) : 0xff;
        return out;
    }

    // A change of the pins.
    void pins(bool on, bool clock, bool command, uint64_t now) {
        if (on != selected_) {
            select(on, now);
            shown_ = true;
        } else if (on && clock && !clock_) {
            in_ = static_cast<uint8_t>(in_ << 1 | command);
            if (++bits_ == 8) {
                bits_ = 0;
                exchange(in_, now);
            }
        } else if (on && !clock && clock_) {
            shown_ = out_ >> (7 - bits_) & 1;
        }
        clock_ = clock;
    }
    bool data() const { return shown_; }

    // The power goes off and comes back.
    void cut(uint64_t now) {
        settle(now);
        if (end_ > now)
            part(now < begun_ ? 0 : static_cast<double>(now - begun_) / static_cast<double>(end_ - begun_));
        end_ = 0;
        selected_ = enabled_ = dead_ = false;
        bytes_ = bits_ = 0;
    }
    // Cut the power after so many units: a programmed byte is one, an erase has ERASE_UNITS. The
    // memory then answers nothing until `cut`.
    void cut_after(int64_t units) { left_ = units; }
    uint64_t units() const { return units_; }

    uint8_t at(uint32_t address) const {
        const auto found = sectors_.find(address / SECTOR);
        return found == sectors_.end() ? 0xff : found->second[address % SECTOR];
    }
    void put(uint32_t address, uint8_t value) { byte(address) = value; }
    uint64_t erasures(uint32_t sector) const {
        const auto found = erasures_.find(sector);
        return found == erasures_.end() ? 0 : found->second;
    }

private:
    enum Command { IDENTIFY = 0x9f, READ = 0x03, STATUS = 0x05, ENABLE = 0x06, DISABLE = 0x04,
                   PROGRAM = 0x02, ERASE = 0x20, NOTHING = -1 };
    static constexpr uint8_t IDENTITY[3] = {0xef, 0x40, 0x18};

    uint8_t& byte(uint32_t address) {
        auto [found, added] = sectors_.try_emplace(address / SECTOR);
        if (added)
            found->second.fill(0xff);
        return found->second[address % SECTOR];
    }

    uint8_t status(uint64_t now) {
        settle(now);
        return static_cast<uint8_t>((end_ != 0) | enabled_ << 1);
    }

    // A byte of a command; returns the next byte to come out.
    uint8_t take(uint8_t in, uint64_t now) {
        settle(now);
        const unsigned index = bytes_++;
        if (index == 0) {
            command_ = end_ != 0 && in != STATUS ? static_cast<int>(NOTHING) : in;
            address_ = 0;
            page_.clear();
        } else if (index < 4) {
            address_ = (address_ << 8 | in) % SIZE;
        } else if (command_ == PROGRAM) {
            page_.push_back(in);
        }
        switch (command_) {
        case IDENTIFY: return index < 3 ? IDENTITY[index] : 0xff;
        case STATUS: return status(now);
        case READ: return index < 3 ? 0xff : at((address_ + index - 3) % SIZE);
        default: return 0xff;
        }
    }

    // The memory was deselected after whole bytes: carry the command out.
    void begin(uint64_t now) {
        if (command_ == ENABLE && bytes_ == 1)
            enabled_ = true;
        if (command_ == DISABLE && bytes_ == 1)
            enabled_ = false;
        const bool programs = command_ == PROGRAM && !page_.empty();
        const bool erases = command_ == ERASE && bytes_ == 4;
        if (!enabled_ || !(programs || erases))
            return;
        erasing_ = erases;
        target_ = address_;
        written_ = page_;
        const unsigned size = erases ? ERASE_UNITS : static_cast<unsigned>(written_.size());
        if (erases)
            ++erasures_[target_ / SECTOR];
        if (left_ >= 0 && left_ < static_cast<int64_t>(size)) {
            part(static_cast<double>(left_) / size);
            units_ += static_cast<uint64_t>(left_);
            dead_ = true;
            left_ = -1;
            return;
        }
        if (left_ >= 0)
            left_ -= size;
        units_ += size;
        begun_ = now;
        end_ = now + static_cast<uint64_t>(clock_hz_ * (erases ? SECTOR_S : PAGE_S)) + 1;
    }

    // A program goes round within its page; of more bytes than it has the last ones count.
    uint32_t place(size_t index) const {
        return target_ / PAGE * PAGE + static_cast<uint32_t>(target_ + index) % PAGE;
    }

    void settle(uint64_t now) {
        if (end_ == 0 || now < end_)
            return;
        if (erasing_)
            sectors_.erase(target_ / SECTOR);
        else
            for (size_t i = 0; i < written_.size(); ++i)
                byte(place(i)) &= written_[i];
        end_ = 0;
        enabled_ = false;
    }

    // Carry a share of the operation out.
    void part(double share) {
        if (erasing_) {
            const uint32_t first = target_ / SECTOR * SECTOR;
            for (uint32_t i = 0; i < SECTOR; ++i)
                for (int bit = 0; bit < 8; ++bit)
                    if (random_.uniform() < share)
                        byte(first + i) |= static_cast<uint8_t>(1 << bit);
            return;
        }
        const auto whole = static_cast<size_t>(share * static_cast<double>(written_.size()) + 0.5);
        for (size_t i = 0; i < written_.size() && i <= whole; ++i) {
            uint8_t value = written_[i];
            for (int bit = 0; i == whole && bit < 8; ++bit)
                if (random_.uniform() < 0.5)
                    value |= static_cast<uint8_t>(1 << bit);
            byte(place(i)) &= value;
        }
    }

    double clock_hz_ = 2e6;
    Random random_;
    std::map<uint32_t, std::array<uint8_t, SECTOR>> sectors_;  // those that are not blank
    std::map<uint32_t, uint64_t> erasures_;
    bool selected_ = false, enabled_ = false, erasing_ = false, dead_ = false;
    bool clock_ = false, shown_ = true;
    unsigned bytes_ = 0, bits_ = 0;
    uint8_t in_ = 0, out_ = 0xff;
    int command_ = NOTHING;
    uint32_t address_ = 0;              // of the command that comes
    std::vector<uint8_t> page_;
    uint32_t target_ = 0;               // of the operation under way
    std::vector<uint8_t> written_;
    uint64_t begun_ = 0, end_ = 0, units_ = 0;  // end 0: not busy
    int64_t left_ = -1;
};

}  // namespace plant
