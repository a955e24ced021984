/* SPDX-License-Identifier: Apache-2.0 */
/* Reset and trap entry of the soft core (VexRiscv, RV32IMC, machine mode only). */

    .option arch, +zicsr
    .section .text.start, "ax"
    .globl _start
_start:
    csrw mie, zero
    la sp, __stack_top
    la a0, trap_entry
    csrw mtvec, a0
    la a0, __bss_start
    la a1, __bss_end
1:  bgeu a0, a1, 2f
    sw zero, 0(a0)
    addi a0, a0, 4
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
