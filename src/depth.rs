//! The depth test: what is stored, what is compared, and what is added before.
//!
//! A fragment's depth leaves interpolation as an `f32` inside the viewport's depth range. It is first converted to
//! the depth buffer's own format and *then* compared with the stored value, as Vulkan and Direct3D do, so that equal
//! stored values compare equal whatever was lost on the way.

/// A number that a depth buffer stores.
///
/// **Law**: [`from_depth`](Self::from_depth) is monotonic, so that a format may merge two depths but never swaps them. Draws
/// rely on it where they leave out what is hidden, and ask for depths that no fragment has.
///
/// | type | range | step | conversion of d ∈ \[0, 1\] |
/// | --- | --- | --- | --- |
/// | `f32` | any | floating | d |
/// | `u16` | 0 ..= 65 535 | 1 / 65 535 | round(d · 65 535), the product rounded to `f32` first |
/// | [`Depth24`] | 0 ..= 16 777 215 | 1 / (2²⁴ − 1) | round(d · (2²⁴ − 1)), exactly rounded |
/// | `u32` | 0 ..= 2³² − 1 | 1 / (2³² − 1) | round(d · (2³² − 1)), the product rounded to `f64` first |
/// | `()` | none | | no depth buffer: every fragment passes |
///
/// A lookup in a shadow map compares `from_depth` of the receiver's depth with the stored value.
///
/// On a processor without double-precision floats, `u16` and `f32` are the fast ones: the other two convert in `f64`.
///
/// # Examples
/// ```
/// use halfplane::{Depth24, DepthFormat};
/// assert_eq!(u16::from_depth(1.0), 65_535);
/// assert_eq!(Depth24::from_depth(0.5), Depth24(8_388_608)); // a tie goes to the even number
/// assert_eq!(u32::from_depth(1.0), u32::MAX);
/// ```
pub trait DepthFormat: Copy + PartialOrd {
    /// Whether there is anything to compare with. `false` only for `()`: then every fragment passes.
    const IS_STORED: bool = true;

    /// The nearest stored value, for a depth in 0 ..= 1; of others, any value.
    fn from_depth(depth: f32) -> Self;

    /// The smallest difference that the format resolves near `depth`: `r` in Vulkan's "Depth Bias Computation". Finite, and not
    /// negative.
    fn resolution(depth: f32) -> f32;
}

/// Whether a fragment at `z` passes; without a depth buffer it does.
#[inline(always)]
pub(crate) fn passes<D: DepthFormat>(test: impl DepthTest, z: f32, old: D) -> bool {
    !D::IS_STORED || test.passes(D::from_depth(z), old)
}

/// Clamps with two comparisons, which are two instructions; `f32::clamp` also has to keep NaN.
#[inline(always)]
pub(crate) fn clamp(x: f32, low: f32, high: f32) -> f32 {
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
}

impl DepthFormat for f32 {
    #[inline(always)]
    fn from_depth(depth: f32) -> Self {
        depth
    }

    /// 2^(e − 23), with e the exponent of `depth`: one unit in the last place.
    fn resolution(depth: f32) -> f32 {
        let exponent = depth.to_bits() & 0x7f80_0000;
        f32::from_bits(exponent.saturating_sub(23 << 23).max(1 << 23))
    }
}

impl DepthFormat for u16 {
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "the low 16 bits of 2²³ + n are n")]
    fn from_depth(depth: f32) -> Self {
        // 2²³ + x has a last place of 1: adding rounds, and the integer stands in the low bits.
        (depth * 65_535.0 + 8_388_608.0).to_bits() as u16
    }

    fn resolution(_: f32) -> f32 {
        1.0 / 65_535.0
    }
}

/// A 24-bit fixed-point depth in the low bits of a `u32`, the high eight bits zero.
///
/// ```
/// use halfplane::{Depth24, DepthFormat};
/// let far = [Depth24::from_depth(1.0); 4];
/// assert_eq!(far[0].0, 0x00ff_ffff);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Depth24(pub u32);

impl DepthFormat for Depth24 {
    #[inline(always)]
    fn from_depth(depth: f32) -> Self {
        Self(fixed_from_depth(depth, 16_777_215.0))
    }

    fn resolution(_: f32) -> f32 {
        1.0 / 16_777_215.0
    }
}

impl DepthFormat for u32 {
    #[inline(always)]
    fn from_depth(depth: f32) -> Self {
        fixed_from_depth(depth, 4_294_967_295.0)
    }

    fn resolution(_: f32) -> f32 {
        1.0 / 4_294_967_296.0
    }
}

/// round(depth · max), to even in ties: 2⁵² rounds. For 24 bits the product is exact in `f64`; for 32 bits it is rounded
/// there first, by at most 2⁻²¹.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the low 32 bits of 2⁵² + n are n")]
fn fixed_from_depth(depth: f32, max: f64) -> u32 {
    (f64::from(depth) * max + 4_503_599_627_370_496.0).to_bits() as u32
}

impl DepthFormat for () {
    const IS_STORED: bool = false;

    #[inline(always)]
    fn from_depth(_: f32) -> Self {}

    fn resolution(_: f32) -> f32 {
        0.0
    }
}

/// Decides whether a fragment passes, and whether its depth is then stored.
///
/// The eight comparisons are types ([`Less`], [`Always`], …) for those who name one: a program carries the code of the
/// comparisons that it uses. [`DepthState`] decides at run time.
///
/// ```
/// use halfplane::{DepthTest, DepthState, CompareOp, Less, ReadOnly};
/// assert!(Less.passes(0.25, 0.5) && Less.writes());
/// assert!(!ReadOnly(Less).writes());
/// let chosen = DepthState { compare: CompareOp::GreaterOrEqual, write: true };
/// assert!(chosen.passes(0.5, 0.5));
/// assert_eq!((ReadOnly(Less).compare(), chosen.compare()), (Some(CompareOp::Less), Some(CompareOp::GreaterOrEqual)));
/// ```
pub trait DepthTest: Copy {
    /// Whether a fragment of depth `new` passes against the stored `old`.
    fn passes<D: PartialOrd>(self, new: D, old: D) -> bool;

    /// Whether a fragment that passes replaces the stored depth.
    #[inline(always)]
    fn writes(self) -> bool {
        true
    }

    /// Which of the eight comparisons [`passes`](Self::passes) makes, if it makes one.
    ///
    /// Draws and [`CoarseDepth`](crate::CoarseDepth) rely on it to leave out what is hidden: with a wrong answer, fragments are
    /// lost. With `None` nothing is left out early, and each draw that writes depth forgets what is known of the rows that it
    /// may draw to. A test around another one, as [`ReadOnly`], gives that one's answer.
    #[inline(always)]
    fn compare(self) -> Option<CompareOp> {
        None
    }
}

macro_rules! compare_types {
    ($($(#[$doc:meta])* $name:ident = |$new:ident, $old:ident| $passes:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name;

        impl DepthTest for $name {
            #[inline(always)]
            fn passes<D: PartialOrd>(self, $new: D, $old: D) -> bool {
                $passes
            }

            #[inline(always)]
            fn compare(self) -> Option<CompareOp> {
                Some(CompareOp::$name)
            }
        }
    )*};
}

compare_types! {
    /// No fragment passes.
    Never = |_new, _old| false;
    /// new < old: the nearer fragment wins, the usual test with 0 near and 1 far.
    Less = |new, old| new < old;
    /// new = old: the second pass over the same geometry.
    Equal = |new, old| new == old;
    /// new ≤ old.
    LessOrEqual = |new, old| new <= old;
    /// new > old: the usual test with reverse Z, 1 near and 0 far.
    Greater = |new, old| new > old;
    /// new ≠ old.
    NotEqual = |new, old| new != old;
    /// new ≥ old.
    GreaterOrEqual = |new, old| new >= old;
    /// Every fragment passes; with depth writes, the last one stays.
    Always = |_new, _old| true;
}

/// Tests like the test that it wraps but stores no depth, as for transparent surfaces over opaque ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOnly<T>(pub T);

impl<T: DepthTest> DepthTest for ReadOnly<T> {
    #[inline(always)]
    fn passes<D: PartialOrd>(self, new: D, old: D) -> bool {
        self.0.passes(new, old)
    }

    #[inline(always)]
    fn writes(self) -> bool {
        false
    }

    #[inline(always)]
    fn compare(self) -> Option<CompareOp> {
        self.0.compare()
    }
}

/// The eight comparisons as a value (`VkCompareOp`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CompareOp {
    /// See [`Never`].
    Never,
    /// See [`Less`].
    #[default]
    Less,
    /// See [`Equal`].
    Equal,
    /// See [`LessOrEqual`].
    LessOrEqual,
    /// See [`Greater`].
    Greater,
    /// See [`NotEqual`].
    NotEqual,
    /// See [`GreaterOrEqual`].
    GreaterOrEqual,
    /// See [`Always`].
    Always,
}

/// A depth test chosen at run time. Costs three comparisons a fragment where a type costs one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DepthState {
    /// Which fragments pass.
    pub compare: CompareOp,
    /// Whether those that pass store their depth.
    pub write: bool,
}

impl Default for DepthState {
    fn default() -> Self {
        Self { compare: CompareOp::Less, write: true }
    }
}

impl DepthTest for DepthState {
    #[inline(always)]
    fn passes<D: PartialOrd>(self, new: D, old: D) -> bool {
        use CompareOp::{Always, Equal, Greater, GreaterOrEqual, Less, LessOrEqual, Never, NotEqual};
        // A comparison is a subset of {<, =, >}. Masks instead of a `match` a fragment keep the loop free of branches.
        let less = !matches!(self.compare, Never | Equal | Greater | GreaterOrEqual);
        let equal = !matches!(self.compare, Never | Less | Greater | NotEqual);
        let greater = !matches!(self.compare, Never | Less | Equal | LessOrEqual);
        // What is unordered (a NaN in the caller's buffer) passes only `Always` and `NotEqual`, as with the types.
        let unordered = matches!(self.compare, Always | NotEqual);
        let (is_less, is_equal, is_greater) = (new < old, new == old, new > old);
        (less & is_less)
            | (equal & is_equal)
            | (greater & is_greater)
            | (unordered & !(is_less | is_equal | is_greater))
    }

    #[inline(always)]
    fn writes(self) -> bool {
        self.write
    }

    #[inline(always)]
    fn compare(self) -> Option<CompareOp> {
        Some(self.compare)
    }
}

/// Moves the depth of a whole triangle before it is tested (Vulkan "Depth Bias Computation"; Direct3D 11.3 §15.10).
///
/// ```text
///   bias = constant · r + slope · m      r = the depth format's resolution at the triangle's largest depth
///                                        m = max(|∂z/∂x|, |∂z/∂y|), per pixel
/// ```
/// then limited to `clamp`: at most it when positive, at least it when negative, not at all when zero. A positive bias
/// moves away from the viewer (towards depth 1), as a shadow map wants with [`Less`]; with reverse Z a negative one does.
/// Depths stay inside the viewport's depth range.
///
/// # Examples
/// ```
/// # use halfplane::{DepthBias, Rasterizer, Viewport};
/// let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
/// rasterizer.depth_bias = DepthBias { constant: 1.0, slope: 1.5, clamp: 0.01 }; // a shadow map's
/// # Ok::<(), halfplane::ViewportError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthBias {
    /// In units of the format's resolution.
    pub constant: f32,
    /// In units of the triangle's steepest depth slope.
    pub slope: f32,
    /// The largest bias, or the smallest when negative, as a depth. Zero: no limit.
    pub clamp: f32,
}

impl DepthBias {
    /// None if all three are zero: asked once a draw, and not for each triangle.
    pub(crate) fn unless_zero(self) -> Option<Self> {
        (self != Self::default()).then_some(self)
    }

    /// The bias of a triangle with steepest slope `m` and format resolution `r`.
    pub(crate) fn of(self, m: f32, r: f32) -> f32 {
        let bias = self.constant * r + self.slope * m;
        let over = if self.clamp > 0.0 { bias > self.clamp } else { self.clamp < 0.0 && bias < self.clamp };
        if over { self.clamp } else { bias }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_point_formats_round_to_nearest() {
        for (depth, expected) in [(0.0, 0), (1.0, 65_535), (0.5, 32_768), (1.5 / 65_535.0, 2)] {
            assert_eq!(u16::from_depth(depth), expected, "{depth}");
        }
        assert_eq!(u32::from_depth(1.0), u32::MAX, "the largest depth");
        assert_eq!(u32::from_depth(f32::EPSILON), 512, "2⁻²³ of 2³² − 1 is just below 512");
        assert_eq!(Depth24::from_depth(1.0).0, 0x00ff_ffff, "24 bits set");
    }

    #[test]
    fn the_enum_agrees_with_the_types() {
        fn check<T: DepthTest>(compare: CompareOp, test: T) {
            let state = DepthState { compare, write: true };
            for new in [0.0, 0.5, 1.0, f32::NAN] {
                for old in [0.0, 0.5, 1.0, f32::NAN] {
                    assert_eq!(state.passes(new, old), test.passes(new, old), "{compare:?} {new} {old}");
                }
            }
        }
        check(CompareOp::Never, Never);
        check(CompareOp::Less, Less);
        check(CompareOp::Equal, Equal);
        check(CompareOp::LessOrEqual, LessOrEqual);
        check(CompareOp::Greater, Greater);
        check(CompareOp::NotEqual, NotEqual);
        check(CompareOp::GreaterOrEqual, GreaterOrEqual);
        check(CompareOp::Always, Always);
    }

    #[test]
    fn float_resolution_is_one_unit_in_the_last_place() {
        for depth in [1.0f32, 0.75, 0.5, 0.1, 1e-3] {
            assert_eq!(f32::resolution(depth), depth.next_up() - depth, "{depth}");
        }
    }

    #[test]
    fn bias_is_limited_on_the_side_of_its_sign() {
        let bias = |clamp| DepthBias { constant: 2.0, slope: 0.0, clamp }.of(0.0, 1.0);
        assert_eq!((bias(0.0), bias(1.0), bias(3.0), bias(-1.0)), (2.0, 1.0, 2.0, 2.0), "constant 2, r = 1");
    }
}
