//! From clip space to framebuffer coordinates: the viewport, and the conventions of clip space.

use glam::Vec4;

use crate::target::{DOMAIN, EXTENT, Rect};

/// The depth range of clip space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ClipDepth {
    /// 0 ≤ z ≤ w: Direct3D, Vulkan, Metal, WebGPU; glam's `camera::rh::proj::directx` and `…::vulkan`.
    #[default]
    ZeroToOne,
    /// −w ≤ z ≤ w: OpenGL; glam's `camera::rh::proj::opengl`.
    NegativeOneToOne,
}

impl ClipDepth {
    /// The position with its depth brought to 0 ≤ z ≤ w.
    #[inline(always)]
    pub(crate) fn to_zero_to_one(self, position: Vec4) -> Vec4 {
        match self {
            Self::ZeroToOne => position,
            // Halves first: the sum of two large numbers could be infinite.
            Self::NegativeOneToOne => position.with_z(position.z * 0.5 + position.w * 0.5),
        }
    }

    /// The depths of four positions, brought to 0 ≤ z ≤ w.
    #[inline(always)]
    pub(crate) fn four_to_zero_to_one(self, z: Vec4, w: Vec4) -> Vec4 {
        match self {
            Self::ZeroToOne => z,
            Self::NegativeOneToOne => z * 0.5 + w * 0.5,
        }
    }
}

/// Which part of the frame clip space is mapped to (Vulkan "Controlling the Viewport").
///
/// ```text
///   x_f = x + width  · (x_ndc + 1) / 2         x_ndc = x_clip / w, and so on
///   y_f = y + height · (1 − y_ndc) / 2         y_ndc points up, y_f down
///   z_f = min_depth + (max_depth − min_depth) · z_ndc
/// ```
///
/// Nothing is drawn outside it: a panel of a larger picture needs no scissor. `min_depth` may be the larger one. A
/// negative `height` turns the picture over: with `y` at the bottom it shows geometry made for Vulkan's clip space, whose
/// y points down, upright.
///
/// # Examples
/// ```
/// use halfplane::Viewport;
/// let whole = Viewport::of_size(640, 480)?;
/// let right_half = Viewport::new(320.0, 0.0, 320.0, 480.0)?;
/// let vulkan = Viewport::new(0.0, 480.0, 640.0, -480.0)?;
/// let sky = whole.with_depth_range(1.0, 1.0)?; // behind everything; with `LessOrEqual`, since 1 is not less than a cleared 1
/// assert_eq!(
///     Viewport::new(0.0, 0.0, 0.0, 480.0).unwrap_err().to_string(),
///     "a viewport's width must be a number above 0, not 0"
/// );
/// # let _ = (right_half, vulkan, sky);
/// # Ok::<(), halfplane::ViewportError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    x: f32,
    y: f32,
    width: f32,
    height: f32,
    min_depth: f32,
    max_depth: f32,
}

/// Why a [`Viewport`] cannot be made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ViewportError {
    /// The width is zero, negative, infinite or no number.
    Width(f32),
    /// The height is zero, infinite or no number.
    Height(f32),
    /// A side lies outside of −16384 ..= 16384, or is no number.
    OutOfRange(f32),
    /// An end of the depth range lies outside of 0 ..= 1, or is no number.
    Depth(f32),
}

impl core::fmt::Display for ViewportError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Width(x) => write!(f, "a viewport's width must be a number above 0, not {x}"),
            Self::Height(x) => write!(f, "a viewport's height must be a number other than 0, not {x}"),
            Self::OutOfRange(x) => {
                write!(f, "a viewport's sides must lie in -{EXTENT}..={EXTENT} pixels, not at {x}")
            }
            Self::Depth(x) => write!(f, "the ends of a depth range must lie in 0..=1, not at {x}"),
        }
    }
}

impl core::error::Error for ViewportError {}

impl Viewport {
    /// A whole frame of `width` × `height` pixels, depth range 0 to 1.
    ///
    /// # Errors
    /// When a side is 0 or more than 16 384.
    #[expect(clippy::cast_precision_loss, reason = "exact up to 2²⁴, and refused from 2¹⁴")]
    pub fn of_size(width: u32, height: u32) -> Result<Self, ViewportError> {
        Self::new(0.0, 0.0, width as f32, height as f32)
    }

    /// The rectangle with its left end at `x`, its top at `y` and a size in pixels, depth range 0 to 1. None need be
    /// whole numbers.
    ///
    /// # Errors
    /// When `width` is not above 0, `height` is 0, or a side lies outside of −16384 ..= 16384.
    pub fn new(x: f32, y: f32, width: f32, height: f32) -> Result<Self, ViewportError> {
        if !(width > 0.0 && width.is_finite()) {
            return Err(ViewportError::Width(width));
        }
        if height == 0.0 || !height.is_finite() {
            return Err(ViewportError::Height(height));
        }
        let limit = EXTENT as f32;
        for side in [x, y, x + width, y + height] {
            if !(-limit..=limit).contains(&side) {
                return Err(ViewportError::OutOfRange(side));
            }
        }
        Ok(Self { x, y, width, height, min_depth: 0.0, max_depth: 1.0 })
    }

    /// Maps NDC depth 0 to `min_depth` and 1 to `max_depth`.
    ///
    /// # Errors
    /// When one of them lies outside of 0 ..= 1.
    pub fn with_depth_range(self, min_depth: f32, max_depth: f32) -> Result<Self, ViewportError> {
        for depth in [min_depth, max_depth] {
            if !(0.0..=1.0).contains(&depth) {
                return Err(ViewportError::Depth(depth));
            }
        }
        Ok(Self { min_depth, max_depth, ..self })
    }

    /// The smallest and the largest depth.
    #[inline(always)]
    pub(crate) fn depth_limits(&self) -> (f32, f32) {
        let (a, b) = (self.min_depth + 0.0, self.max_depth + 0.0); // no −0
        if a < b { (a, b) } else { (b, a) }
    }

    /// The largest coordinate of its sides, in magnitude.
    pub(crate) fn reach(&self) -> f32 {
        let sides = [self.x, self.y, self.x + self.width, self.y + self.height];
        sides.into_iter().fold(0.0, |reach, side| if side.abs() > reach { side.abs() } else { reach })
    }

    /// The pixels whose samples lie inside.
    pub(crate) fn pixels(&self) -> Rect {
        let (top, bottom) =
            if self.height > 0.0 { (self.y, self.y + self.height) } else { (self.y + self.height, self.y) };
        Rect::from_edges(
            first_sample(self.x),
            first_sample(top),
            first_sample(self.x + self.width),
            first_sample(bottom),
        )
        .intersection(DOMAIN)
    }

    /// Its formula as one multiplication and one addition a coordinate.
    #[inline(always)]
    pub(crate) fn transform(&self) -> ViewportTransform {
        ViewportTransform {
            scale: [self.width * 0.5, self.height * -0.5, self.max_depth - self.min_depth],
            offset: [self.x + self.width * 0.5, self.y + self.height * 0.5, self.min_depth],
        }
    }
}

/// The first pixel whose sample, at its centre, lies at or after `edge`: ⌈edge − ½⌉. `edge` lies in ±2¹⁴.
#[expect(
    clippy::cast_possible_truncation,
    reason = "within ±2¹⁴; once a draw, so a saturating conversion may be slow"
)]
fn first_sample(edge: f32) -> i32 {
    let below = (edge - 0.5) as i32; // towards zero
    below + i32::from((below as f32) < edge - 0.5)
}

/// framebuffer = ndc · scale + offset, for x, y and depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewportTransform {
    pub(crate) scale: [f32; 3],
    pub(crate) offset: [f32; 3],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_ndc_are_corners_of_the_viewport() {
        let transform = Viewport::new(10.0, 20.0, 64.0, 32.0).expect("valid").transform();
        let at = |x: f32, y: f32| {
            (x * transform.scale[0] + transform.offset[0], y * transform.scale[1] + transform.offset[1])
        };
        assert_eq!((at(-1.0, 1.0), at(1.0, -1.0)), ((10.0, 20.0), (74.0, 52.0)), "y up becomes y down");
        let vulkan = Viewport::new(0.0, 32.0, 64.0, -32.0).expect("valid").transform();
        assert_eq!(-vulkan.scale[1] + vulkan.offset[1], 0.0, "y = −1 is the top with a negative height");
    }

    #[test]
    fn a_pixel_belongs_to_the_viewport_that_holds_its_sample() {
        let pixels = |x, width| {
            let pixels = Viewport::new(x, 0.0, width, 1.0).expect("valid").pixels();
            (pixels.x, pixels.right())
        };
        assert_eq!(pixels(0.0, 4.0), (0, 4), "whole pixels");
        assert_eq!(pixels(0.5, 4.0), (0, 4), "samples at ½: the left side is in, the right side is out");
        assert_eq!(pixels(0.75, 4.0), (1, 5), "between samples");
        assert_eq!(pixels(-0.75, 1.0), (-1, 0), "left of the origin");
        assert_eq!(pixels(0.6, 0.2), (1, 1), "no sample");
    }

    #[test]
    fn what_is_wrong_is_told() {
        assert_eq!(Viewport::of_size(0, 1), Err(ViewportError::Width(0.0)), "width");
        assert_eq!(Viewport::of_size(1, 20_000), Err(ViewportError::OutOfRange(20_000.0)), "too far");
        assert!(matches!(Viewport::new(f32::NAN, 0.0, 1.0, 1.0), Err(ViewportError::OutOfRange(_))), "NaN");
        assert!(matches!(Viewport::new(0.0, 0.0, 1.0, f32::INFINITY), Err(ViewportError::Height(_))), "∞");
        let whole = Viewport::of_size(1, 1).expect("valid");
        assert_eq!(whole.with_depth_range(0.0, 1.5), Err(ViewportError::Depth(1.5)), "depth");
    }
}
