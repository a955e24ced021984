/* SPDX-License-Identifier: Apache-2.0 */
/* memcpy and memset, which the compiler calls for structures. The compiler's own versions, built
   for size, move single bytes: a structure of 300 bytes took 2000 clocks. Each loop has one branch,
   at its end: `a5` is where it ends. */

    .section .text.calls, "ax"
    .globl memcpy
memcpy:
    mv a3, a0
    or a4, a0, a1
    andi a4, a4, 3
    bnez a4, 3f
    andi a5, a2, -16
    beqz a5, 2f
    add a5, a5, a0
1:  lw t0, 0(a1)
    lw t1, 4(a1)
    lw t2, 8(a1)
    lw t3, 12(a1)
    sw t0, 0(a3)
    sw t1, 4(a3)
    sw t2, 8(a3)
    sw t3, 12(a3)
    addi a1, a1, 16
    addi a3, a3, 16
    bne a3, a5, 1b
2:  andi a5, a2, -4
    add a5, a5, a0
    beq a3, a5, 3f
4:  lw t0, 0(a1)
    sw t0, 0(a3)
    addi a1, a1, 4
    addi a3, a3, 4
    bne a3, a5, 4b
3:  add a5, a0, a2
    beq a3, a5, 5f
6:  lbu t0, 0(a1)
    sb t0, 0(a3)
    addi a1, a1, 1
    addi a3, a3, 1
    bne a3, a5, 6b
5:  ret

    .globl memset
memset:
    mv a3, a0
    andi a4, a0, 3
    bnez a4, 3f
    beqz a1, 7f         /* mostly; a4 is zero */
    andi a1, a1, 255
    slli a4, a1, 8
    or a4, a4, a1
    slli a5, a4, 16
    or a4, a4, a5
7:  andi a5, a2, -32
    beqz a5, 2f
    add a5, a5, a0
1:  sw a4, 0(a3)
    sw a4, 4(a3)
    sw a4, 8(a3)
    sw a4, 12(a3)
    sw a4, 16(a3)
    sw a4, 20(a3)
    sw a4, 24(a3)
    sw a4, 28(a3)
    addi a3, a3, 32
    bne a3, a5, 1b
2:  andi a5, a2, -4
    add a5, a5, a0
    beq a3, a5, 3f
4:  sw a4, 0(a3)
    addi a3, a3, 4
    bne a3, a5, 4b
3:  add a5, a0, a2
    beq a3, a5, 5f
6:  sb a1, 0(a3)
    addi a3, a3, 1
    bne a3, a5, 6b
5:  ret
