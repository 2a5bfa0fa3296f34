//! Proof that `halfplane` and what it depends on are `no_std`.
//!
//! A static library is linked as a whole, and a program may have one panic handler. This one brings its own; if anything
//! below linked `std`, there would be two, and the build would stop with "duplicate lang item". So building it is the
//! test, on any target:
//!
//! ```text
//!   cargo build --manifest-path tests/no_std/Cargo.toml
//! ```
//!
//! With `--features std` it links `std` on purpose and fails, as it should.
//!
//! It also shows what a program in another language would link: a function with a C interface that draws.
#![no_std]

#[cfg(feature = "std")]
extern crate std;

use core::panic::PanicInfo;
use core::slice;

use halfplane::glam::{Vec3, Vec4};
use halfplane::{Primitives, ProjectedVertex, Rasterizer, Surface, Viewport, pack_rgb565};

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}

/// Draws a quad into `size` × `size` pixels of RGB565 and 16-bit depth. Returns how many samples passed, or `u64::MAX`
/// when something is wrong.
///
/// # Safety
/// `color` and `depth` point to `size · size` elements each that nothing else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halfplane_draw(color: *mut u16, depth: *mut u16, size: u16) -> u64 {
    let len = usize::from(size) * usize::from(size);
    // SAFETY: as the caller promises.
    let (color, depth) =
        unsafe { (slice::from_raw_parts_mut(color, len), slice::from_raw_parts_mut(depth, len)) };
    draw(color, depth, u32::from(size)).unwrap_or(u64::MAX)
}

fn draw(color: &mut [u16], depth: &mut [u16], size: u32) -> Option<u64> {
    const POSITIONS: [Vec4; 4] = [
        Vec4::new(-1.0, -1.0, 0.0, 1.0),
        Vec4::new(1.0, -1.0, 0.0, 1.0),
        Vec4::new(4.0, 4.0, 3.0, 4.0),
        Vec4::new(-4.0, 4.0, 3.0, 4.0),
    ];
    const COLORS: [Vec3; 4] = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
    let mut target = Surface::new(color, depth, size, size).ok()?;
    let rasterizer = Rasterizer::<Vec3>::new(Viewport::of_size(size, size).ok()?);
    let mut room = [ProjectedVertex::default(); 4];
    let vertices = rasterizer.project(&POSITIONS, &mut room).ok()?;
    let quad = Primitives::fan().indexed(&[0u8, 1, 2, 3]);
    let shade = |fragment: halfplane::Fragment<'_, Vec3>| pack_rgb565(fragment.varyings());
    Some(rasterizer.draw(&mut target, quad, vertices, &COLORS, shade).ok()?.samples_passed)
}
