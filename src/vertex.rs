//! Where vertices come from: anything that answers "what is the value at vertex `i`?".
//!
//! Attributes may lie in a struct each, in arrays of their own, be the same for every vertex, or be computed when they
//! are asked for. A draw reads positions for each triangle, and again for those that may be seen, unless they were
//! projected before; and varyings only for triangles that may be seen.

/// Values by vertex index.
///
/// Implemented for slices and arrays of `Copy` types, for [`Attribute`], for [`Computed`], for references to all of
/// these, and for tuples, which gather several attributes into one value.
///
/// **Law**: the same index gives the same value for the whole of a draw. Where it does not, the picture is any; nothing
/// else breaks.
///
/// A `Vec` is passed as a slice, `&vec[..]`: this crate knows no allocator.
///
/// # Examples
/// ```
/// use halfplane::{Attribute, Attributes};
/// let colors = [[255u8, 0, 0], [0, 255, 0]];
/// let normal = [0.0f32, 0.0, 1.0];
/// let both = (&colors, Attribute::constant(&normal));
/// assert_eq!(both.fetch(1), Some(([0, 255, 0], [0.0, 0.0, 1.0])));
/// assert_eq!(both.len(), 2, "as many as the shortest; a constant has no end");
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not give values by vertex index",
    note = "pass a `Vec` as a slice: `&vec[..]`"
)]
pub trait Attributes {
    /// The value at a vertex.
    type Value: Copy;

    /// How many vertices there are; `usize::MAX` when there is no end.
    fn len(&self) -> usize;

    /// Whether there are no vertices.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value at vertex `index`: `Some` for every index below [`len`](Self::len).
    fn fetch(&self, index: usize) -> Option<Self::Value>;
}

impl<A: Attributes + ?Sized> Attributes for &A {
    type Value = A::Value;

    #[inline(always)]
    fn len(&self) -> usize {
        (**self).len()
    }

    #[inline(always)]
    fn fetch(&self, index: usize) -> Option<A::Value> {
        (**self).fetch(index)
    }
}

impl<T: Copy> Attributes for [T] {
    type Value = T;

    #[inline(always)]
    fn len(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn fetch(&self, index: usize) -> Option<T> {
        self.get(index).copied()
    }
}

impl<T: Copy, const N: usize> Attributes for [T; N] {
    type Value = T;

    #[inline(always)]
    fn len(&self) -> usize {
        N
    }

    #[inline(always)]
    fn fetch(&self, index: usize) -> Option<T> {
        self.get(index).copied()
    }
}

/// No attributes at all, for draws that need only positions.
impl Attributes for () {
    type Value = ();

    #[inline(always)]
    fn len(&self) -> usize {
        usize::MAX
    }

    #[inline(always)]
    fn fetch(&self, _: usize) -> Option<()> {
        Some(())
    }
}

macro_rules! tuples_of_attributes {
    ($($name:ident $index:tt),+) => {
        impl<$($name: Attributes),+> Attributes for ($($name,)+) {
            type Value = ($($name::Value,)+);

            #[inline(always)]
            fn len(&self) -> usize {
                usize::MAX$(.min(self.$index.len()))+
            }

            #[inline(always)]
            fn fetch(&self, index: usize) -> Option<Self::Value> {
                Some(($(self.$index.fetch(index)?,)+))
            }
        }
    };
}

tuples_of_attributes!(A 0);
tuples_of_attributes!(A 0, B 1);
tuples_of_attributes!(A 0, B 1, C 2);
tuples_of_attributes!(A 0, B 1, C 2, D 3);
tuples_of_attributes!(A 0, B 1, C 2, D 3, E 4);
tuples_of_attributes!(A 0, B 1, C 2, D 3, E 4, F 5);

/// One attribute in the caller's memory: a slice of it, one field of a slice of structs, or one value for every vertex.
///
/// ```text
///   value(i) = field(&elements[i · stride])      stride: 1 if nothing else is said, n for every n-th element, 0 for a constant
/// ```
///
/// `T` is what the attribute holds and `S` what the memory holds, the same unless it is a struct. Reading through
/// `field` costs an indirect call where the compiler cannot see which function it is; a plain slice costs none.
///
/// # Examples
/// ```
/// use glam::{Vec3, Vec4};
/// use halfplane::{Attribute, Attributes};
///
/// struct Vertex { position: Vec4, color: Vec3 }
/// let mesh = [
///     Vertex { position: Vec4::W, color: Vec3::X },
///     Vertex { position: Vec4::ONE, color: Vec3::Y },
/// ];
/// let interleaved = Attribute::field(&mesh, |vertex| vertex.color);
/// let separate = Attribute::slice(&[Vec3::X, Vec3::Y]);
/// let constant = Attribute::constant(&Vec3::Z);
/// assert_eq!(interleaved.fetch(1), separate.fetch(1));
/// assert_eq!(constant.fetch(1_000_000), Some(Vec3::Z));
/// # let _ = mesh[0].position;
/// ```
#[derive(Debug)]
pub struct Attribute<'a, T, S = T> {
    elements: &'a [S],
    stride: usize,
    field: fn(&S) -> T,
}

impl<T, S> Clone for Attribute<'_, T, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T, S> Copy for Attribute<'_, T, S> {}

impl<'a, T: Copy> Attribute<'a, T> {
    /// The elements of a slice, one a vertex.
    #[must_use]
    pub fn slice(elements: &'a [T]) -> Self {
        Self::field(elements, |element| *element)
    }

    /// The same value for every vertex: stride 0.
    #[must_use]
    pub fn constant(value: &'a T) -> Self {
        Self { elements: core::slice::from_ref(value), stride: 0, field: |element| *element }
    }
}

impl<'a, T: Copy, S> Attribute<'a, T, S> {
    /// One field of each struct of a slice, or anything else that a function makes of it. The function captures nothing: a vertex
    /// shader with a matrix is a [`Computed`].
    ///
    /// ```
    /// use glam::{Vec2, Vec3};
    /// use halfplane::{Attribute, Attributes, Flat};
    /// struct Vertex { normal: Vec3, uv: Vec2, material: u32 }
    /// let mesh = [Vertex { normal: Vec3::Z, uv: Vec2::X, material: 7 }];
    /// // For a `Rasterizer<(Vec2, Flat<u32>)>`.
    /// let varyings =
    ///     (Attribute::field(&mesh, |vertex| vertex.uv), Attribute::field(&mesh, |vertex| Flat(vertex.material)));
    /// assert_eq!(varyings.fetch(0), Some((Vec2::X, Flat(7))));
    /// # let _ = mesh[0].normal;
    /// ```
    #[must_use]
    pub fn field(elements: &'a [S], field: fn(&S) -> T) -> Self {
        Self { elements, stride: 1, field }
    }

    /// Takes every `stride`-th element only: vertex `i` is element `i · stride`. Zero makes the first element a constant.
    ///
    /// ```
    /// # use glam::{Vec2, vec2, vec4};
    /// # use halfplane::{Attribute, Attributes};
    /// // Position, texture coordinate, position, texture coordinate, …
    /// let interleaved = [vec2(0.0, 1.0), vec2(0.5, 0.5), vec2(2.0, 3.0), vec2(1.0, 0.0)];
    /// let positions = Attribute::field(&interleaved, |at| at.extend(0.0).extend(1.0)).with_stride(2);
    /// let uvs = Attribute::slice(&interleaved[1..]).with_stride(2);
    /// assert_eq!((positions.len(), positions.fetch(1)), (2, Some(vec4(2.0, 3.0, 0.0, 1.0))));
    /// assert_eq!((uvs.len(), uvs.fetch(1)), (2, Some(Vec2::X)));
    /// ```
    #[must_use]
    pub fn with_stride(self, stride: usize) -> Self {
        Self { stride, ..self }
    }
}

impl<T: Copy, S> Attributes for Attribute<'_, T, S> {
    type Value = T;

    #[inline(always)]
    fn len(&self) -> usize {
        match (self.elements.len(), self.stride) {
            (0, _) => 0,
            (_, 0) => usize::MAX,
            (len, stride) => len.div_ceil(stride),
        }
    }

    #[inline(always)]
    fn fetch(&self, index: usize) -> Option<T> {
        index.checked_mul(self.stride).and_then(|at| self.elements.get(at)).map(self.field)
    }
}

/// Attributes that a function computes: a vertex shader.
///
/// As positions, it runs once for each vertex through [`Rasterizer::project`](crate::Rasterizer::project), and again for
/// the vertices of triangles that are clipped; without `project`, whenever a triangle names a vertex that the triangle
/// before did not, and again for the vertices of triangles that may be seen. (Where there is no SIMD: for every vertex of
/// every triangle.) As varyings, it runs for the corners of each triangle that may be seen.
///
/// # Examples
/// ```
/// use glam::{Mat4, Vec3, Vec4};
/// use halfplane::{Attributes, Computed};
/// let model = [Vec3::X, Vec3::Y];
/// let matrix = Mat4::from_scale(Vec3::splat(0.5));
/// let positions = Computed::new(model.len(), |i| matrix * model[i].extend(1.0));
/// assert_eq!(positions.fetch(1), Some(Vec4::new(0.0, 0.5, 0.0, 1.0)));
/// assert_eq!(positions.fetch(2), None, "the function is never asked for more than there are");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Computed<F> {
    len: usize,
    function: F,
}

impl<T: Copy, F: Fn(usize) -> T> Computed<F> {
    /// `function(i)` for each vertex i < `len`.
    pub fn new(len: usize, function: F) -> Self {
        Self { len, function }
    }
}

impl<T: Copy, F: Fn(usize) -> T> Attributes for Computed<F> {
    type Value = T;

    #[inline(always)]
    fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    fn fetch(&self, index: usize) -> Option<T> {
        (index < self.len).then(|| (self.function)(index))
    }
}
