//! Interpolation: three vertices' values and a fragment's weights make the fragment's value.
//!
//! On the screen, attributes divided by w vary linearly and attributes themselves do not (Blinn 1992, "Hyperbolic
//! interpolation"). So there are two sets of weights: *barycentrics* α', β', γ', linear on the screen, and the
//! perspective-correct *weights*
//!
//! ```text
//!                  α' / w_a
//!   α = ─────────────────────────────     and so on; their sum is 1, and where all w are equal α = α'
//!       α'/w_a  +  β'/w_b  +  γ'/w_c
//! ```

use core::ops::{Add, Mul, Sub};
use glam::{Vec2, Vec3, Vec3A, Vec4};

/// What a fragment knows of its place in the triangle: the weights to interpolate with.
///
/// Only what is used is computed: after inlining, weights that no value asks for leave no instruction behind. For a derivative it
/// holds how the weights change, and [`smooth`](Self::smooth) gives the change of the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    perspective: Share,
    linear: Share,
    provoking: u8,
}

/// How three values a, b, c become one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Share {
    /// Their mean c + (a − c) α + (b − c) β, with the first c times the sum of all three weights.
    ///
    /// Not a α + b β + c γ: this form gives three equal values back exactly, and its differences do not change along a
    /// row, so the compiler computes them once.
    Mean { alpha: f32, beta: f32, sum: f32 },
    /// (a − c) ∂α + (b − c) ∂β: the mean's change, by that of the weights.
    Change { d_alpha: f32, d_beta: f32 },
    /// (∂n − v ∂s) w: the change of the mean v = n / s, where s is 1/w, and p and q are weights before the division by s. n and v are
    /// made of a − c and b − c; so large values with small differences lose nothing.
    Quotient { dp: f32, dq: f32, ds: f32, alpha: f32, beta: f32, w: f32 },
}

impl Share {
    #[inline(always)]
    fn mix<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>>(self, [a, b, c]: [T; 3]) -> T {
        match self {
            Self::Mean { alpha, beta, sum } => c * sum + (a - c) * alpha + (b - c) * beta,
            Self::Change { d_alpha, d_beta } => (a - c) * d_alpha + (b - c) * d_beta,
            Self::Quotient { dp, dq, ds, alpha, beta, w } => {
                let (dn, v) = ((a - c) * dp + (b - c) * dq, (a - c) * alpha + (b - c) * beta);
                (dn - v * ds) * w
            }
        }
    }
}

impl Weights {
    /// Perspective-correct weights, screen-linear barycentrics, and the number of the provoking vertex, in the order of the
    /// three vertices that they will be applied to. The third of each counts by what the sum of the three is.
    ///
    /// ```
    /// use halfplane::{Varyings, Weights};
    /// let middle_of_an_edge = Weights::new([0.25, 0.75, 0.0], [0.5, 0.5, 0.0], 0);
    /// assert_eq!(f32::interpolate(&[0.0, 8.0, 100.0], &middle_of_an_edge), 6.0);
    /// ```
    #[inline(always)]
    #[must_use]
    pub fn new(perspective: [f32; 3], linear: [f32; 3], provoking: u8) -> Self {
        let share = |[alpha, beta, c]: [f32; 3]| Share::Mean { alpha, beta, sum: alpha + beta + c };
        Self { perspective: share(perspective), linear: share(linear), provoking }
    }

    /// Weights that sum up to 1, without a rounded addition to find out.
    #[inline(always)]
    pub(crate) fn of_value(perspective: [f32; 2], linear: [f32; 2], provoking: u8) -> Self {
        let share = |[alpha, beta]: [f32; 2]| Share::Mean { alpha, beta, sum: 1.0 };
        Self { perspective: share(perspective), linear: share(linear), provoking }
    }

    /// What gives a value's change, by the changes of p, q and s where the perspective-correct weights are these, and by
    /// those of the screen-linear weights.
    #[inline(always)]
    pub(crate) fn of_change(
        ([dp, dq], ds): ([f32; 2], f32),
        ([alpha, beta], w): ([f32; 2], f32),
        linear: [f32; 2],
        provoking: u8,
    ) -> Self {
        Self {
            perspective: Share::Quotient { dp, dq, ds, alpha, beta, w },
            linear: Share::Change { d_alpha: linear[0], d_beta: linear[1] },
            provoking,
        }
    }

    /// The perspective-correct mean: what most attributes want.
    #[inline(always)]
    #[must_use]
    pub fn smooth<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>>(
        &self,
        values: [T; 3],
    ) -> T {
        self.perspective.mix(values)
    }

    /// The value of the provoking vertex.
    #[inline(always)]
    #[must_use]
    pub fn flat<T: Copy>(&self, [a, b, c]: [T; 3]) -> T {
        match self.provoking {
            0 => a,
            1 => b,
            _ => c,
        }
    }

    /// The same fragment with its screen-linear weights in place of the perspective-correct ones.
    #[inline(always)]
    #[must_use]
    pub fn no_perspective(&self) -> Self {
        Self { perspective: self.linear, ..*self }
    }
}

/// Values that a triangle's vertices have and its fragments get.
///
/// **Law**: the value is linear in the weights, so that weights that sum to 1 give a point of the triangle, and the
/// weights' derivatives, which sum to 0, give the value's derivative. ([`Flat`] has no derivative and keeps its value.)
///
/// Implemented for `f32`, glam's vectors, arrays, tuples and `()`; [`Flat`] and [`NoPerspective`] qualify any of them.
/// A struct does it with [`varyings!`](crate::varyings), or by hand:
///
/// # Examples
/// ```
/// use glam::{Vec2, Vec3};
/// use halfplane::{Flat, Varyings, Weights};
///
/// #[derive(Clone, Copy)]
/// struct Skin { normal: Vec3, uv: Vec2, material: Flat<u32> }
///
/// impl Varyings for Skin {
///     #[inline(always)] // lets a shading loop become SIMD, and leaves out what only derivatives need
///     fn interpolate([a, b, c]: &[Self; 3], weights: &Weights) -> Self {
///         Self {
///             normal: weights.smooth([a.normal, b.normal, c.normal]),
///             uv: weights.smooth([a.uv, b.uv, c.uv]),
///             material: weights.flat([a.material, b.material, c.material]),
///         }
///     }
/// }
/// ```
pub trait Varyings: Copy {
    /// The value at a fragment.
    fn interpolate(vertices: &[Self; 3], weights: &Weights) -> Self;
}

macro_rules! smooth_varyings {
    ($($type:ty),*) => {$(
        impl Varyings for $type {
            #[inline(always)]
            fn interpolate(vertices: &[Self; 3], weights: &Weights) -> Self {
                weights.smooth(*vertices)
            }
        }
    )*};
}

smooth_varyings!(f32, Vec2, Vec3, Vec3A, Vec4);

impl Varyings for () {
    #[inline(always)]
    fn interpolate(_: &[Self; 3], _: &Weights) -> Self {}
}

impl<T: Varyings, const N: usize> Varyings for [T; N] {
    #[inline(always)]
    fn interpolate([a, b, c]: &[Self; 3], weights: &Weights) -> Self {
        let mut values = *a;
        for (((value, a), b), c) in values.iter_mut().zip(a).zip(b).zip(c) {
            *value = T::interpolate(&[*a, *b, *c], weights);
        }
        values
    }
}

macro_rules! tuples_of_varyings {
    ($($name:ident $index:tt),+) => {
        impl<$($name: Varyings),+> Varyings for ($($name,)+) {
            #[inline(always)]
            fn interpolate([a, b, c]: &[Self; 3], weights: &Weights) -> Self {
                ($($name::interpolate(&[a.$index, b.$index, c.$index], weights),)+)
            }
        }
    };
}

tuples_of_varyings!(A 0);
tuples_of_varyings!(A 0, B 1);
tuples_of_varyings!(A 0, B 1, C 2);
tuples_of_varyings!(A 0, B 1, C 2, D 3);
tuples_of_varyings!(A 0, B 1, C 2, D 3, E 4);
tuples_of_varyings!(A 0, B 1, C 2, D 3, E 4, F 5);

/// Takes the provoking vertex's value for the whole triangle: `flat` of GLSL, `nointerpolation` of HLSL. For anything
/// that is `Copy`, numbers or not.
///
/// ```
/// use halfplane::{Flat, Varyings, Weights};
/// let weights = Weights::new([0.2, 0.3, 0.5], [0.2, 0.3, 0.5], 1);
/// assert_eq!(Flat::interpolate(&[Flat("a"), Flat("b"), Flat("c")], &weights), Flat("b"));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Flat<T>(pub T);

impl<T: Copy> Varyings for Flat<T> {
    #[inline(always)]
    fn interpolate(vertices: &[Self; 3], weights: &Weights) -> Self {
        weights.flat(*vertices)
    }
}

/// Interpolates linearly on the screen, without regard to perspective: `noperspective` of GLSL and HLSL, and the
/// "naive" way of tutorials.
///
/// ```
/// use halfplane::{NoPerspective, Varyings, Weights};
/// let weights = Weights::new([0.25, 0.75, 0.0], [0.5, 0.5, 0.0], 0);
/// let vertices = [0.0, 8.0, 100.0].map(NoPerspective);
/// assert_eq!(NoPerspective::interpolate(&vertices, &weights).0, 4.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct NoPerspective<T>(pub T);

impl<T: Varyings> Varyings for NoPerspective<T> {
    #[inline(always)]
    fn interpolate([a, b, c]: &[Self; 3], weights: &Weights) -> Self {
        Self(T::interpolate(&[a.0, b.0, c.0], &weights.no_perspective()))
    }
}

/// Implements [`Varyings`](crate::Varyings) for a struct, field by field. Name every field.
///
/// # Examples
/// ```
/// use glam::{Vec2, Vec3};
/// use halfplane::{Flat, NoPerspective};
///
/// #[derive(Clone, Copy)]
/// struct Skin {
///     normal: Vec3,
///     uv: Vec2,
///     screen: NoPerspective<Vec2>,
///     material: Flat<u32>,
/// }
///
/// halfplane::varyings!(Skin { normal, uv, screen, material });
/// ```
#[macro_export]
macro_rules! varyings {
    ($name:ty { $($field:ident),* $(,)? }) => {
        impl $crate::Varyings for $name {
            #[inline(always)]
            fn interpolate([a, b, c]: &[Self; 3], weights: &$crate::Weights) -> Self {
                Self { $($field: $crate::Varyings::interpolate(&[a.$field, b.$field, c.$field], weights)),* }
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_stay_equal() {
        for value in [0.1f32, 1.0 / 3.0, 255.0, -7.7e10] {
            for [a, b] in [[0.3, 0.3], [0.123_456, 0.7], [1.0, 0.0], [0.0, 0.0]] {
                let weights = Weights::of_value([a, b], [a, b], 0);
                assert_eq!(f32::interpolate(&[value; 3], &weights), value, "{value} {a} {b}");
            }
        }
    }

    #[test]
    fn qualifiers_reach_into_structs_tuples_and_arrays() {
        #[derive(Clone, Copy)]
        struct All {
            smooth: [f32; 2],
            pair: (Vec2, NoPerspective<f32>),
            flat: Flat<u8>,
        }
        varyings!(All { smooth, pair, flat });
        let vertex = |x: f32, flat| All {
            smooth: [x, 2.0 * x],
            pair: (Vec2::splat(x), NoPerspective(x)),
            flat: Flat(flat),
        };
        let weights = Weights::new([0.25, 0.75, 0.0], [0.5, 0.5, 0.0], 2);
        let all = All::interpolate(&[vertex(0.0, 1), vertex(8.0, 2), vertex(50.0, 3)], &weights);
        assert_eq!(all.smooth, [6.0, 12.0], "perspective");
        assert_eq!(all.pair, (Vec2::splat(6.0), NoPerspective(4.0)), "each its own way");
        assert_eq!(all.flat, Flat(3), "provoking");
    }
}
