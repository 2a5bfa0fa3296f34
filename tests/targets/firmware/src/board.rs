//! What differs between the boards: the entry point, and how instructions are counted.

#[cfg(target_arch = "arm")]
pub use cortex_m_rt::entry;
#[cfg(target_arch = "riscv32")]
pub use riscv_rt::entry;

/// Instructions executed since some moment, modulo 2³². For QEMU's MPS2 boards under `-icount shift=6`: an instruction
/// takes 64 ns then, and timer 0 counts down at 25 MHz.
#[cfg(target_arch = "arm")]
fn counter() -> u32 {
    /// Control, value and reload register of the first "CMSDK APB timer".
    const TIMER: *mut u32 = 0x4000_0000 as *mut u32;
    // SAFETY: device registers that nothing else uses.
    unsafe {
        if TIMER.read_volatile() == 0 {
            TIMER.add(2).write_volatile(u32::MAX);
            TIMER.add(1).write_volatile(u32::MAX);
            TIMER.write_volatile(1);
        }
        u32::MAX - TIMER.add(1).read_volatile()
    }
}

#[cfg(target_arch = "arm")]
fn to_instructions(ticks: u32) -> u32 {
    (u64::from(ticks) * 10 / 16) as u32
}

/// Exact under `-icount`.
#[cfg(target_arch = "riscv32")]
fn counter() -> u32 {
    let count: u32;
    // SAFETY: reads a counter.
    unsafe { core::arch::asm!("csrr {}, minstret", out(reg) count, options(nomem, nostack)) };
    count
}

#[cfg(target_arch = "riscv32")]
fn to_instructions(count: u32) -> u32 {
    count
}

/// How many instructions `f` takes, and its result.
#[inline(never)]
pub fn instructions<R>(f: impl FnOnce() -> R) -> (u32, R) {
    counter();
    let start = counter();
    let result = f();
    (to_instructions(counter().wrapping_sub(start)), result)
}

/// How many bytes of stack `f` takes, and its result. Paints the free stack, and looks how much paint is left.
#[inline(never)]
pub fn stack<R>(f: impl FnOnce() -> R) -> (usize, R) {
    const PAINT: u32 = 0xc5c5_c5c5;
    const DEPTH: usize = 8 * 1024; // free on every board here
    let top = stack_pointer() & !3;
    let words = || (top - DEPTH..top).step_by(4).map(|address| address as *mut u32);
    for word in words().take(DEPTH / 4 - 16) {
        // SAFETY: RAM below the stack pointer, minus what this loop itself may use.
        unsafe { word.write_volatile(PAINT) };
    }
    let result = f();
    // SAFETY: as above.
    let untouched = words().take_while(|word| unsafe { word.read_volatile() } == PAINT).count();
    (DEPTH - 4 * untouched, result)
}

fn stack_pointer() -> usize {
    let pointer: usize;
    // SAFETY: copies a register.
    #[cfg(target_arch = "arm")]
    unsafe {
        core::arch::asm!("mov {}, sp", out(reg) pointer, options(nomem, nostack))
    };
    #[cfg(target_arch = "riscv32")]
    unsafe {
        core::arch::asm!("mv {}, sp", out(reg) pointer, options(nomem, nostack))
    };
    pointer
}
