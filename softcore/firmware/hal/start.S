/* SPDX-License-Identifier: Apache-2.0 */
/* Reset and trap entry of the soft core (VexRiscv, RV32IMC, machine mode only). */

#include "hal/edition.h"

    .option arch, +zicsr
    .section .text.start, "ax"
    .globl _start
_start:
    .option push
    .option norvc
    j 1f
    .option pop
    /* Words 1 to 3 of the image say what it is (store/slots.h). */
    .word 0x49464b47            /* GKFI */
    .word GATEWARE_EDITION
    .word __ram_size
1:  csrw mie, zero
    la sp, __stack_top
    la a0, trap_entry
    csrw mtvec, a0
    la a0, __bss_start
    la a1, __bss_end
1:  bgeu a0, a1, 2f
    sw zero, 0(a0)
    sw zero, 4(a0)
    sw zero, 8(a0)
    sw zero, 12(a0)
    addi a0, a0, 16
    j 1b
2:  call main
3:  j 3b

/* Saves the registers that a C function may change. The handler is a C function and saves the
   others itself. Aligned because mtvec drops the two lowest bits. */
    .align 4
trap_entry:
    addi sp, sp, -64
    sw t0, 4(sp)
    sw t1, 8(sp)
    /* Usually only the watchdog's interrupt is pending (IRQ_WATCH). It is answered here, as
       main_loop_interrupt would do, but in a twentieth of the clocks. */
    csrr t0, mcause
    bgez t0, 1f
    csrr t0, 0xfc0
    li t1, 2
    bne t0, t1, 1f
    li t0, 0x80000800           /* SAFETY; pet is at 12 */
    li t1, 0xc3
    sw t1, 12(t0)
    lw t0, 4(sp)
    lw t1, 8(sp)
    addi sp, sp, 64
    mret
1:  sw ra, 0(sp)
    sw t2, 12(sp)
    sw a0, 16(sp)
    sw a1, 20(sp)
    sw a2, 24(sp)
    sw a3, 28(sp)
    sw a4, 32(sp)
    sw a5, 36(sp)
    sw a6, 40(sp)
    sw a7, 44(sp)
    sw t3, 48(sp)
    sw t4, 52(sp)
    sw t5, 56(sp)
    sw t6, 60(sp)
    csrr a0, mcause
    call trap
    lw ra, 0(sp)
    lw t0, 4(sp)
    lw t1, 8(sp)
    lw t2, 12(sp)
    lw a0, 16(sp)
    lw a1, 20(sp)
    lw a2, 24(sp)
    lw a3, 28(sp)
    lw a4, 32(sp)
    lw a5, 36(sp)
    lw a6, 40(sp)
    lw a7, 44(sp)
    lw t3, 48(sp)
    lw t4, 52(sp)
    lw t5, 56(sp)
    lw t6, 60(sp)
    addi sp, sp, 64
    mret

/* Takes an image from the flash memory, whose next bytes are its words, to address 0, and starts it:
   a0 words, a1 its digest, as in app/image_watch.c. Runs from a copy at another place (hal_regs.c).
   The first word comes last: until the digest is right, a reset finds an endless loop. So does an
   image that was read wrong; the watchdog has not been called, and all outputs are safe. */
    .align 4
    .globl image_loader, image_loader_end
image_loader:
    li t0, 0x80000080           /* FLASH; send, select and status are at 0, 4 and 8 */
    li a2, 0x9e3779b1
    li a3, 0                    /* address */
    li a4, 0                    /* digest so far */
    li t1, 0x6f                 /* j . */
    sw t1, 0(zero)
1:  li t3, 4                    /* bytes of a word */
2:  sw zero, 0(t0)
3:  lw t1, 8(t0)
    andi t4, t1, 0x100          /* busy */
    bnez t4, 3b
    slli t1, t1, 24
    srli t2, t2, 8
    or t2, t2, t1
    addi t3, t3, -1
    bnez t3, 2b
    addi a0, a0, -1
    beqz a0, 5f
    xor a4, a4, t2
    mul a4, a4, a2
    srli t1, a4, 15
    xor a4, a4, t1
    bnez a3, 4f
    mv a5, t2
    j 6f
4:  sw t2, 0(a3)
6:  addi a3, a3, 4
    j 1b
5:  sw t2, 0(a3)                /* the last word is the digest */
    sw zero, 4(t0)
    bne t2, a4, 7f
    bne t2, a1, 7f
    sw a5, 0(zero)
    .word 0x0000100f            /* fence.i: the instruction cache has the old firmware */
    jr zero
7:  j 7b
image_loader_end:
