//! Conversions that shaders end with: floats to pixels and to integers.
//!
//! Rust's `as` from float to integer saturates, and the range check it needs costs a shading loop most of its SIMD
//! (measured: the whole loop three to five times slower). These clamp first, or state their range, and then let a float
//! addition do the rounding: 2²³ has a last place of 1, so x + 2²³ holds the nearest integer in its low bits.

use glam::{Vec3, Vec4};

use crate::depth::clamp;
use crate::project::round;
use crate::traverse::HAS_FLOAT_LANES;

/// 2²³.
const ROUNDING: f32 = 8_388_608.0;

/// round(x · (2ⁿ − 1)), with x clamped to 0 ..= 1 and NaN as 0.
///
/// The product is rounded to `f32` before it is rounded to an integer, to even in ties. So the result is within
/// ½ + 2⁻¹⁷ of the exact product: only a product that near to a half can go to the other side of it.
#[inline(always)]
fn unorm<const BITS: u32>(x: f32) -> u32 {
    if HAS_FLOAT_LANES { unorm_by_float::<BITS>(x) } else { unorm_by_integer::<BITS>(x) }
}

/// With both limits in floats: two instructions that every SIMD has, where SSE2 has no minimum of integers.
#[inline(always)]
fn unorm_by_float<const BITS: u32>(x: f32) -> u32 {
    let max = (1 << BITS) - 1;
    (clamp(x, 0.0, 1.0) * max as f32 + ROUNDING).to_bits() & 0x007f_ffff
}

/// The same with both limits in integers: a microcontroller compares floats in four instructions, and has one that
/// saturates integers.
#[inline(always)]
fn unorm_by_integer<const BITS: u32>(x: f32) -> u32 {
    // Bits, as integers, are in the order of the floats they stand for. Moved up by 2²², what comes after ∞ wraps around
    // and becomes less than 0 is: NaN, which is quiet after an addition. (2²² is a constant that an instruction can hold.)
    const QUIET: i32 = 1 << 22;
    let max = (1 << BITS) - 1;
    let bits = (x * max as f32 + ROUNDING).to_bits() as i32;
    let rounded = bits.wrapping_add(QUIET).saturating_sub(ROUNDING.to_bits() as i32 + QUIET);
    rounded.clamp(0, max) as u32
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
    unorm::<8>(r) | unorm::<8>(g) << 8 | unorm::<8>(b) << 16 | unorm::<8>(a) << 24
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
    (unorm::<5>(r) << 11 | unorm::<6>(g) << 5 | unorm::<5>(b)) as u16
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

/// The nonlinear value of a linear one, as a byte: what displays and image files expect of light that was added up.
///
/// ```text
///   round(255 · (12.92 x                  for x ≤ 0.0031308,
///                1.055 x^(1/2.4) − 0.055  above))            IEC 61966-2-1
/// ```
///
/// Exactly rounded for every `f32`; what lies outside of 0 ..= 1 is clamped, and NaN is 0. No branch and no power: an
/// estimate that is at most one too high, and a look into a table of the 256 places where the result changes. In a closure, a
/// table is in the way of SIMD: there, [`pack_srgba8`] is faster.
///
/// ```
/// use halfplane::{linear_to_srgb8, srgb8_to_linear};
/// assert_eq!([0.0, 0.214, 0.5, 1.0].map(linear_to_srgb8), [0, 127, 188, 255]);
/// assert!((0..=255).all(|byte| linear_to_srgb8(srgb8_to_linear(byte)) == byte));
/// ```
#[inline(always)]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "0 ..= 255")]
pub fn linear_to_srgb8(linear: f32) -> u8 {
    srgb(linear, is_below_by_table) as u8
}

/// The linear value of a nonlinear byte: the `f32` nearest to the inverse of [`linear_to_srgb8`]'s formula.
///
/// ```
/// assert_eq!([0, 128, 255].map(halfplane::srgb8_to_linear), [0.0, 0.215_860_5, 1.0]);
/// ```
#[inline(always)]
#[must_use]
pub fn srgb8_to_linear(byte: u8) -> f32 {
    LINEAR[usize::from(byte)]
}

/// Like [`pack_rgba8`] for linear channels and a nonlinear pixel: R, G and B as by [`linear_to_srgb8`], and A, which has
/// no light, as it is.
///
/// Without a table, where there is SIMD: closures become SIMD with it. Where they do not, as in a loop over many `Vec4`s, three
/// calls of [`linear_to_srgb8`] take half the time.
///
/// ```
/// assert_eq!(halfplane::pack_srgba8(glam::vec4(1.0, 0.5, 0.0, 0.5)), 0x8000_bcff);
/// ```
#[inline(always)]
#[must_use]
pub fn pack_srgba8(color: Vec4) -> u32 {
    let srgb = |x| if HAS_FLOAT_LANES { srgb(x, is_below_by_power) } else { srgb(x, is_below_by_table) };
    let [r, g, b, a] = color.to_array();
    srgb(r) | srgb(g) << 8 | srgb(b) << 16 | unorm::<8>(a) << 24
}

/// A nonlinear pixel as linear channels: the inverse of [`pack_srgba8`].
///
/// ```
/// let color = halfplane::unpack_srgba8(0x8000_bcff);
/// assert_eq!(halfplane::pack_srgba8(color), 0x8000_bcff);
/// ```
#[inline(always)]
#[must_use]
pub fn unpack_srgba8(pixel: u32) -> Vec4 {
    let [r, g, b, _] = pixel.to_le_bytes();
    Vec3::new(srgb8_to_linear(r), srgb8_to_linear(g), srgb8_to_linear(b)).extend(unpack_rgba8(pixel).w)
}

/// See [`linear_to_srgb8`]. `is_below` says whether a linear value becomes less than a byte.
#[inline(always)]
fn srgb(linear: f32, is_below: impl Fn(f32, u32) -> bool) -> u32 {
    let x = clamp(linear, 0.0, 1.0);
    // A rational function, fitted to lie between the nonlinear value (in 0 ..= 255) and 1 more, and to end below 255.5.
    let estimate = (((18_069.0 * x + 50_879.0) * x + 3952.0) * x + 0.317) / ((212.03 * x + 72.33) * x + 1.0);
    let byte = (estimate + ROUNDING).to_bits() & 0xff;
    byte - u32::from(is_below(x, byte))
}

/// The fewest steps for one number.
#[inline(always)]
fn is_below_by_table(x: f32, byte: u32) -> bool {
    FIRST_LINEAR.get(byte as usize).is_some_and(|&first| x < first)
}

/// Twice as many, but they become SIMD: 255 (1.055 x^(1/2.4) − 0.055) is compared with what lies half between this byte and the one
/// before, both to the 12th power, in `f64`. All roundings together are less than 2⁻⁴⁸ of the powers, and none of the 255 borders
/// lies that near to an `f32`.
#[inline(always)]
#[expect(clippy::cast_possible_wrap, reason = "a byte")]
fn is_below_by_power(x: f32, byte: u32) -> bool {
    // Up to the border below byte 10, the formula is a line.
    const LAST_OF_LINE: u32 = 10;
    let (x, border) = (f64::from(x), f64::from(byte as i32) - 0.5);
    let base = border + 255.0 * 0.055;
    let (square, x2) = (base * base, x * x);
    let fourth = square * square;
    let power = fourth * fourth * fourth;
    if byte > LAST_OF_LINE { SCALE_12 * x * (x2 * x2) < power } else { 255.0 * 12.92 * x < border }
}

/// (255 · 1.055)¹².
const SCALE_12: f64 = {
    let scale = 255.0 * 1.055;
    let cube = scale * scale * scale;
    (cube * cube) * (cube * cube)
};

/// The linear value of each nonlinear byte.
static LINEAR: [f32; 256] = {
    let mut table = [0.0; 256];
    let mut byte = 0;
    while byte < 256 {
        table[byte] = nearest(linear_from_srgb(byte as f64 / 255.0));
        byte += 1;
    }
    table
};

/// The smallest linear value that becomes each byte.
static FIRST_LINEAR: [f32; 256] = {
    let mut table = [0.0; 256];
    let mut byte = 1;
    while byte < 256 {
        let border = linear_from_srgb((byte as f64 - 0.5) / 255.0);
        let first = nearest(border);
        table[byte] = if (first as f64) < border { f32::from_bits(first.to_bits() + 1) } else { first };
        byte += 1;
    }
    table
};

#[expect(clippy::cast_possible_truncation, reason = "to the nearest is what is wanted")]
const fn nearest(x: f64) -> f32 {
    x as f32
}

/// The inverse of the formula at [`linear_to_srgb8`], at compile time.
const fn linear_from_srgb(nonlinear: f64) -> f64 {
    if nonlinear <= 0.04045 {
        return nonlinear / 12.92;
    }
    // u^2.4 = u² · ⁵√u², the root by Newton's method from above.
    let u = (nonlinear + 0.055) / 1.055;
    let square = u * u;
    let mut root = 1.0;
    let mut i = 0;
    while i < 64 {
        root = (4.0 * root + square / (root * root * root * root)) / 5.0;
        i += 1;
    }
    square * root
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

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// What a conversion must also get along with.
    const ODD: [f32; 14] = [
        0.0,
        -0.0,
        f32::MIN_POSITIVE,
        1e-45,
        -1e-45,
        -1.0,
        -1e30,
        1.000_000_1,
        1e30,
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];

    /// The floats around each place where round(x · max) changes, and some others.
    fn around_borders(max: u32) -> impl Iterator<Item = f32> {
        let borders = (0..=2 * max).map(move |twice| nearest(f64::from(twice) * 0.5 / f64::from(max)));
        let near =
            borders.flat_map(|x| (0..9).map(move |i| f32::from_bits((x.to_bits() + i).saturating_sub(4))));
        near.chain(ODD).chain([-f32::NAN])
    }

    fn unorm_is_rounded<const BITS: u32>() {
        let max = (1 << BITS) - 1;
        for x in around_borders(max) {
            let (result, other) = (unorm_by_float::<BITS>(x), unorm_by_integer::<BITS>(x));
            assert_eq!(result, other, "{x:e} by either way");
            if x.is_nan() {
                assert_eq!(result, 0, "NaN");
                continue;
            }
            let exact = f64::from(x.clamp(0.0, 1.0)) * f64::from(max);
            let error = (f64::from(result) - exact).abs();
            assert!(error <= 0.5 + 1.0 / 131_072.0, "{x:e} is {exact}, not {result}");
        }
        for value in 0..=max {
            assert_eq!(unorm::<BITS>(value as f32 / max as f32), value, "comes back");
        }
    }

    #[test]
    fn unorm_rounds_to_the_nearest() {
        unorm_is_rounded::<5>();
        unorm_is_rounded::<6>();
        unorm_is_rounded::<8>();
    }

    #[test]
    #[ignore = "4 billion floats: a minute without optimization"]
    fn unorm_is_the_same_by_float_and_by_integer() {
        for x in (0..=u32::MAX).map(f32::from_bits) {
            assert_eq!(unorm_by_float::<8>(x), unorm_by_integer::<8>(x), "{x:e}");
        }
    }

    fn srgb_by_table(x: f32) -> u32 {
        srgb(x, is_below_by_table)
    }

    fn srgb_by_power(x: f32) -> u32 {
        srgb(x, is_below_by_power)
    }

    /// IEC 61966-2-1, in `f64`.
    fn srgb_by_definition(linear: f32) -> f64 {
        let x = f64::from(linear).clamp(0.0, 1.0);
        255.0 * if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
    }

    #[test]
    fn srgb_is_exactly_rounded_on_both_sides_of_each_border() {
        for byte in 1..=255 {
            // Bisection over all floats: the last below the border, and the first that is not.
            let mut bits = [0, 1f32.to_bits()];
            while bits[1] - bits[0] > 1 {
                let middle = bits[0].midpoint(bits[1]);
                let is_above = srgb_by_definition(f32::from_bits(middle)).round() >= f64::from(byte);
                bits[usize::from(is_above)] = middle;
            }
            let [below, first] = bits.map(f32::from_bits);
            assert_eq!([below, first].map(srgb_by_table), [byte - 1, byte], "{below:e}, {first:e}");
            assert_eq!([below, first].map(srgb_by_power), [byte - 1, byte], "{below:e}, {first:e}");
        }
        assert_eq!(ODD.map(srgb_by_table), ODD.map(srgb_by_power), "either way");
        assert_eq!(ODD.map(linear_to_srgb8), [0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 0, 255, 0, 0]);
    }

    /// Between borders only the estimate could be wrong.
    #[test]
    fn srgb_is_monotonic_on_a_fine_grid() {
        let mut before = 0;
        for x in (0..=1f32.to_bits()).step_by(997).map(f32::from_bits) {
            let byte = srgb_by_table(x);
            assert_eq!(byte, srgb_by_power(x), "{x:e}, either way");
            assert!(byte == before || byte == before + 1, "{before}, then {byte} at {x:e}");
            before = byte;
        }
    }

    #[test]
    #[ignore = "a billion powers: minutes without optimization"]
    fn srgb_is_exactly_rounded_everywhere() {
        for x in (0..=1f32.to_bits()).map(f32::from_bits) {
            let bytes = [srgb_by_table(x), srgb_by_power(x)].map(f64::from);
            assert_eq!(bytes, [srgb_by_definition(x).round(); 2], "{x:e}");
        }
    }

    #[test]
    fn linear_is_the_inverse() {
        for byte in 0..=255 {
            let nonlinear = f64::from(byte) / 255.0;
            let exact = if nonlinear <= 0.04045 {
                nonlinear / 12.92
            } else {
                ((nonlinear + 0.055) / 1.055).powf(2.4)
            };
            assert_eq!(srgb8_to_linear(byte), nearest(exact), "{byte}");
            assert_eq!(linear_to_srgb8(srgb8_to_linear(byte)), byte, "and back");
        }
    }

    #[test]
    fn floor_is_below_and_wrap_is_between_0_and_1() {
        for x in (-2_097_152..2_097_152).step_by(4099).flat_map(|i| {
            let x = i as f32;
            [x, x + 0.25, x + 0.5, f32::from_bits(x.to_bits() + 1), f32::from_bits(x.to_bits().max(1) - 1)]
        }) {
            assert_eq!(f64::from(floor_to_i32(x)), f64::from(x).floor(), "{x}");
            assert!((0.0..=1.0).contains(&wrap(x)), "{x} became {}", wrap(x));
        }
        for x in ODD {
            _ = (floor_to_i32(x), wrap(x)); // anything, but no panic
        }
    }
}
