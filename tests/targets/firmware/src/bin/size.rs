//! Measures flash: built with and without the feature `draw`, the difference is what a draw takes. Never run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use halfplane::glam::{Vec3, Vec4};
use halfplane_firmware::{Frame, board};

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}

static mut FRAME: Frame = Frame::new();

#[board::entry]
fn main() -> ! {
    // SAFETY: the only reference, in a function that runs once.
    let frame = black_box(unsafe { &mut *(&raw mut FRAME) });
    let (positions, colors): (&[Vec4], &[Vec3]) = black_box((&[], &[]));
    let indices: &[u16] = black_box(&[]);
    #[cfg(feature = "draw")]
    black_box(halfplane_firmware::draw(frame, positions, colors, indices));
    black_box((frame.color[0], positions, colors, indices));
    loop {}
}
