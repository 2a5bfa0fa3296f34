//! Links only if nothing that a draw calls can panic, nor projecting, preparing, binning and prefetching: building it is the test.
//! Never run.
//!
//! The panic handler calls a function that is defined nowhere. If the optimiser can prove that no panic is reachable it
//! drops the handler, and nothing is missing.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use halfplane::glam::{Vec3, Vec4};
use halfplane_firmware::board;
use halfplane_firmware::extras::{ALL, Memory, prefetch};

unsafe extern "C" {
    fn this_program_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    // SAFETY: never linked.
    unsafe { this_program_can_panic() }
}

static mut MEMORY: Memory = Memory::new();

#[board::entry]
fn main() -> ! {
    // SAFETY: the only reference, in a function that runs once.
    let memory = black_box(unsafe { &mut *(&raw mut MEMORY) });
    let (positions, colors): (&[Vec4], &[Vec3]) = black_box((&[], &[]));
    let indices: &[u16] = black_box(&[]);
    black_box(prefetch(memory));
    // With the draw that `costs` measures, and that of projected vertices.
    for (_, draw) in black_box(ALL) {
        black_box(draw(memory, (positions, colors, indices)));
    }
    #[cfg(feature = "panics")]
    black_box(indices[black_box(7)]);
    loop {}
}
