//! Links only if nothing that a draw calls can panic: building it is the test. Never run.
//!
//! The panic handler calls a function that is defined nowhere. If the optimiser can prove that no panic is reachable it
//! drops the handler, and nothing is missing.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use halfplane::ProjectedVertex;
use halfplane::glam::{Vec3, Vec4};
use halfplane_firmware::{Frame, board, draw, draw_projected, rasterizer};

unsafe extern "C" {
    fn this_program_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    // SAFETY: never linked.
    unsafe { this_program_can_panic() }
}

static mut FRAME: Frame = Frame::new();

#[board::entry]
fn main() -> ! {
    // SAFETY: the only reference, in a function that runs once.
    let frame = black_box(unsafe { &mut *(&raw mut FRAME) });
    let (positions, colors): (&[Vec4], &[Vec3]) = black_box((&[], &[]));
    let indices: &[u16] = black_box(&[]);
    black_box(draw(frame, positions, colors, indices));
    let mut room = [ProjectedVertex::default(); 16];
    if let Some(Ok(vertices)) = rasterizer().map(|state| state.project(positions, black_box(&mut room))) {
        black_box(draw_projected(frame, vertices, colors, indices));
    }
    #[cfg(feature = "panics")]
    black_box(indices[black_box(7)]);
    loop {}
}
