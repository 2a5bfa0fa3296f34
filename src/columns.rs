//! Columns: values of many fragments, kept as one array for each number in them.

use glam::{Vec2, Vec3, Vec3A, Vec4};

use crate::packet::PACKET;

/// What may be handed from one stage of shading to the next: see [`Staged`](crate::Staged).
///
/// Numbers, `bool`, `Vec2`, `Vec3`, `Vec3A` and `Vec4`, arrays of these, and tuples of none to eight, one in the other. Each number
/// has an array of its own, so that a whole register of them is stored and loaded at once. Where there is SIMD, the arrays have 256
/// elements each, on the stack: a kilobyte for each `f32`, and 64 for a `[f32; 64]`.
///
/// A struct of one's own goes as a tuple of its fields, and [`Flat`](crate::Flat) or [`NoPerspective`](crate::NoPerspective) as what
/// is in it. The trait is sealed, so that there can be more to it one day.
///
/// ```
/// fn is_handed_on<T: halfplane::Columns>() {}
/// is_handed_on::<f32>();
/// is_handed_on::<(glam::Vec3, [u32; 4], bool)>();
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be handed from one stage of shading to the next",
    label = "hand on numbers, glam's vectors, arrays and tuples of them",
    note = "of a struct, hand on a tuple of its fields; of `Flat` and `NoPerspective`, what is in them"
)]
pub trait Columns: sealed::Columns {}

impl<T: sealed::Columns> Columns for T {}

mod sealed {
    #[diagnostic::on_unimplemented(
        message = "`{Self}` cannot be handed from one stage of shading to the next",
        label = "hand on numbers, glam's vectors, arrays and tuples of them",
        note = "of a struct, hand on a tuple of its fields; of `Flat` and `NoPerspective`, what is in them"
    )]
    pub trait Columns: Copy {
        /// The values of as many fragments as there are in a packet.
        type Arrays: Copy;

        /// A value, and arrays, to begin with.
        const BLANK: Self;
        const EMPTY: Self::Arrays;

        /// Stores the value of one fragment, less than [`PACKET`](super::PACKET).
        fn put(self, to: &mut Self::Arrays, at: usize);

        /// The value of one fragment.
        fn get(from: &Self::Arrays, at: usize) -> Self;
    }
}

/// One array.
macro_rules! numbers {
    ($($number:ty: $zero:expr),*) => { $(
        impl sealed::Columns for $number {
            type Arrays = [$number; PACKET];

            const BLANK: $number = $zero;
            const EMPTY: [$number; PACKET] = [$zero; PACKET];

            #[inline(always)]
            fn put(self, to: &mut [$number; PACKET], at: usize) {
                to[at] = self;
            }

            #[inline(always)]
            fn get(from: &[$number; PACKET], at: usize) -> $number {
                from[at]
            }
        }
    )* };
}

numbers!(f32: 0.0, f64: 0.0, bool: false);
numbers!(u8: 0, u16: 0, u32: 0, u64: 0, usize: 0, i8: 0, i16: 0, i32: 0, i64: 0, isize: 0);

/// As many as there are elements.
impl<T: sealed::Columns, const N: usize> sealed::Columns for [T; N] {
    type Arrays = [T::Arrays; N];

    const BLANK: [T; N] = [T::BLANK; N];
    const EMPTY: [T::Arrays; N] = [T::EMPTY; N];

    #[inline(always)]
    fn put(self, to: &mut [T::Arrays; N], at: usize) {
        for (to, element) in to.iter_mut().zip(self) {
            element.put(to, at);
        }
    }

    #[inline(always)]
    fn get(from: &[T::Arrays; N], at: usize) -> Self {
        // By hand: that `from_fn` is inlined, nobody promises.
        let mut value = Self::BLANK;
        for (element, from) in value.iter_mut().zip(from) {
            *element = T::get(from, at);
        }
        value
    }
}

/// Those of the components: a vector as it is would be stored and loaded alone.
macro_rules! vectors {
    ($($vector:ty: $count:literal),*) => { $(
        impl sealed::Columns for $vector {
            type Arrays = [[f32; PACKET]; $count];

            const BLANK: Self = Self::ZERO;
            const EMPTY: Self::Arrays = [[0.0; PACKET]; $count];

            #[inline(always)]
            fn put(self, to: &mut Self::Arrays, at: usize) {
                self.to_array().put(to, at);
            }

            #[inline(always)]
            fn get(from: &Self::Arrays, at: usize) -> Self {
                Self::from_array(<[f32; $count]>::get(from, at))
            }
        }
    )* };
}

vectors!(Vec2: 2, Vec3: 3, Vec3A: 3, Vec4: 4);

/// None.
impl sealed::Columns for () {
    type Arrays = ();

    const BLANK: () = ();
    const EMPTY: () = ();

    #[inline(always)]
    fn put(self, (): &mut (), _: usize) {}

    #[inline(always)]
    fn get((): &(), _: usize) {}
}

/// Those of all fields.
macro_rules! tuples {
    ($($($field:ident $i:tt)*;)*) => { $(
        impl<$($field: sealed::Columns),*> sealed::Columns for ($($field,)*) {
            type Arrays = ($($field::Arrays,)*);

            const BLANK: Self = ($($field::BLANK,)*);
            const EMPTY: Self::Arrays = ($($field::EMPTY,)*);

            #[inline(always)]
            fn put(self, to: &mut Self::Arrays, at: usize) {
                $(self.$i.put(&mut to.$i, at);)*
            }

            #[inline(always)]
            fn get(from: &Self::Arrays, at: usize) -> Self {
                ($($field::get(&from.$i, at),)*)
            }
        }
    )* };
}

tuples! {
    A 0;
    A 0 B 1;
    A 0 B 1 C 2;
    A 0 B 1 C 2 D 3;
    A 0 B 1 C 2 D 3 E 4;
    A 0 B 1 C 2 D 3 E 4 G 5;
    A 0 B 1 C 2 D 3 E 4 G 5 H 6;
    A 0 B 1 C 2 D 3 E 4 G 5 H 6 I 7;
}

#[cfg(test)]
mod tests {
    #![expect(clippy::cast_possible_truncation, reason = "less than 2⁹")]

    use super::sealed::Columns;
    use super::*;

    #[test]
    fn each_value_comes_back_from_its_place() {
        type Value = (Vec2, [u16; 3], bool, (f64, (Vec3, Vec3A), Vec4, u8, i64, ()));
        let value = |i: usize| -> Value {
            let x = i as f32;
            let (vectors, many) = ((Vec3::splat(x + 0.5), Vec3A::splat(-x)), [i as u16, 7, 2 * i as u16]);
            (
                Vec2::new(x, 9.0),
                many,
                i % 3 == 0,
                (x.into(), vectors, Vec4::splat(x), i as u8, -(i as i64), ()),
            )
        };
        let mut arrays = Value::EMPTY;
        for i in 0..PACKET {
            value(i).put(&mut arrays, i);
        }
        for i in (0..PACKET).rev() {
            assert_eq!(Value::get(&arrays, i), value(i));
        }
    }
}
