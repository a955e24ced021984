/* SPDX-License-Identifier: Apache-2.0 */
/* What -msave-restore calls at the begin and the end of a function: __riscv_save_N puts ra and the
   first N of the registers s0 to s11 on the stack; __riscv_restore_N takes them back and returns in
   place of the function. Names, order and link register (t0) are the compiler's. A frame has a
   whole number of 16 bytes, so one entry serves every N with frames of the same size. */

    .macro entries kind, numbers:vararg
    .irp number, \numbers
    .globl __riscv_\kind\()_\number
__riscv_\kind\()_\number:
    .endr
    .endm

    .section .text.calls, "ax"
    entries save, 12
    addi sp, sp, -64
    sw s11, 12(sp)
    sw s10, 16(sp)
    sw s9, 20(sp)
    sw s8, 24(sp)
    sw s7, 28(sp)
    sw s6, 32(sp)
    sw s5, 36(sp)
    sw s4, 40(sp)
    sw s3, 44(sp)
    sw s2, 48(sp)
    sw s1, 52(sp)
    sw s0, 56(sp)
    sw ra, 60(sp)
    jr t0

    entries save, 11, 10, 9, 8
    addi sp, sp, -48
    sw s10, 0(sp)
    sw s9, 4(sp)
    sw s8, 8(sp)
    sw s7, 12(sp)
    sw s6, 16(sp)
    sw s5, 20(sp)
    sw s4, 24(sp)
    sw s3, 28(sp)
    sw s2, 32(sp)
    sw s1, 36(sp)
    sw s0, 40(sp)
    sw ra, 44(sp)
    jr t0

    entries save, 7, 6, 5, 4
    addi sp, sp, -32
    sw s6, 0(sp)
    sw s5, 4(sp)
    sw s4, 8(sp)
    sw s3, 12(sp)
    sw s2, 16(sp)
    sw s1, 20(sp)
    sw s0, 24(sp)
    sw ra, 28(sp)
    jr t0

    entries save, 3, 2, 1, 0
    addi sp, sp, -16
    sw s2, 0(sp)
    sw s1, 4(sp)
    sw s0, 8(sp)
    sw ra, 12(sp)
    jr t0

    entries restore, 12
    lw s11, 12(sp)
    lw s10, 16(sp)
    lw s9, 20(sp)
    lw s8, 24(sp)
    lw s7, 28(sp)
    addi sp, sp, 32             /* the rest is a frame of 32 bytes with s6 on top */
    j 1f

    entries restore, 11, 10, 9, 8
    lw s10, 0(sp)
    lw s9, 4(sp)
    lw s8, 8(sp)
    lw s7, 12(sp)
    addi sp, sp, 16

    entries restore, 7, 6, 5, 4
1:  lw s6, 0(sp)
    lw s5, 4(sp)
    lw s4, 8(sp)
    lw s3, 12(sp)
    addi sp, sp, 16

    entries restore, 3, 2, 1, 0
    lw s2, 0(sp)
    lw s1, 4(sp)
    lw s0, 8(sp)
    lw ra, 12(sp)
    addi sp, sp, 16
    ret
