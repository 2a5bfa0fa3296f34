//! Conversions that shaders end with: floats to pixels and to integers.
//!
//! Rust's `as` from float to integer saturates, and the range check it needs costs a shading loop most of its SIMD
//! (measured: the whole loop three to five times slower). These clamp first, or state their range, and then let a float
//! addition do the rounding: 2²³ has a last place of 1, so x + 2²³ holds the nearest integer in its low bits.

use glam::{Vec3, Vec4};

use crate::depth::clamp;
use crate::project::round;

/// round(x · max), with x clamped to 0 ..= 1 and NaN as 0.
#[inline(always)]
fn unorm(x: f32, max: f32) -> u32 {
    (clamp(x, 0.0, 1.0) * max + 8_388_608.0).to_bits() & 0x007f_ffff
}

/// Four channels in 0 ..= 1 as bytes R, G, B, A, R in the lowest eight bits: the order in memory of a little-endian
/// `RGBA8`. Each is round(255 x); what lies outside is clamped.
///
/// ```
/// use glam::vec4;
/// assert_eq!(halfplane::pack_rgba8(vec4(1.0, 0.5, 0.0, 1.0)), 0xff00_80ff);
/// assert_eq!(halfplane::pack_rgba8(vec4(9.0, -1.0, f32::NAN, 0.25)), 0x4000_00ff);
/// ```
#[inline(always)]
#[must_use]
pub fn pack_rgba8(color: Vec4) -> u32 {
    let [r, g, b, a] = color.to_array();
    unorm(r, 255.0) | unorm(g, 255.0) << 8 | unorm(b, 255.0) << 16 | unorm(a, 255.0) << 24
}

/// Like [`pack_rgba8`] with B in the lowest eight bits: `BGRA8`, what many windowing systems show.
///
/// ```
/// assert_eq!(halfplane::pack_bgra8(glam::vec4(1.0, 0.5, 0.0, 1.0)), 0xffff_8000);
/// ```
#[inline(always)]
#[must_use]
pub fn pack_bgra8(color: Vec4) -> u32 {
    let [r, g, b, a] = color.to_array();
    pack_rgba8(Vec4::new(b, g, r, a))
}

/// Three channels in 0 ..= 1 as `RGB565`, R in the highest five bits: what small displays take.
///
/// ```
/// assert_eq!(halfplane::pack_rgb565(glam::vec3(1.0, 0.5, 0.0)), 0b11111_100000_00000);
/// ```
#[inline(always)]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "5 + 6 + 5 bits")]
pub fn pack_rgb565(color: Vec3) -> u16 {
    let [r, g, b] = color.to_array();
    (unorm(r, 31.0) << 11 | unorm(g, 63.0) << 5 | unorm(b, 31.0)) as u16
}

/// Four bytes R, G, B, A, R in the lowest eight bits, as channels in 0 ..= 1.
///
/// ```
/// let color = halfplane::unpack_rgba8(0xff00_80ff);
/// assert_eq!(halfplane::pack_rgba8(color), 0xff00_80ff);
/// ```
#[inline(always)]
#[must_use]
pub fn unpack_rgba8(pixel: u32) -> Vec4 {
    let channel = |shift: u32| (pixel >> shift & 0xff) as f32;
    Vec4::new(channel(0), channel(8), channel(16), channel(24)) * (1.0 / 255.0)
}

/// The largest integer not above `x`, for x in ±2²¹. Outside of that the result means nothing, but nothing panics.
///
/// ```
/// assert_eq!([-1.5, -1.0, 0.99, 7.0].map(halfplane::floor_to_i32), [-2, -1, 0, 7]);
/// ```
#[inline(always)]
#[must_use]
pub fn floor_to_i32(x: f32) -> i32 {
    let nearest = round(x);
    nearest.wrapping_sub(i32::from(nearest as f32 > x))
}

/// The fractional part x − ⌊x⌋, in 0 ≤ wrap(x) ≤ 1, for x in ±2²¹: repeats a texture. (1 comes back for x just below an
/// integer, whose fraction rounds up.)
///
/// ```
/// assert_eq!([0.25, 1.25, -0.25, 3.0].map(halfplane::wrap), [0.25, 0.25, 0.75, 0.0]);
/// ```
#[inline(always)]
#[must_use]
pub fn wrap(x: f32) -> f32 {
    x - floor_to_i32(x) as f32
}
