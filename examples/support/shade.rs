//! What shaders are made of.

use halfplane::glam::Vec3;

/// The vector of length 1 in the same direction.
///
/// Like glam's `normalize`, but with the standard library's square root: one instruction, of which compilers make SIMD.
/// glam without its `std` feature calls a function.
pub fn unit(v: Vec3) -> Vec3 {
    v * (1.0 / v.length_squared().sqrt())
}

/// 0 up to `low`, 1 from `high` on, and smooth between.
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
