//! Primitive assembly: which vertices make which triangle.
//!
//! Orders and provoking vertices are Vulkan's ("Primitive Topologies"): each triangle lists its vertices so that
//! neighbours in a strip or fan wind alike.

use crate::traverse::HAS_FLOAT_LANES;
use crate::triple::each;

/// How a sequence of vertices becomes triangles.
///
/// ```text
///   List    0 1 2   3 4 5   …           Strip   0 ── 2 ── 4         Fan      1 ── 2
///                                               │ ╲  │ ╲  │                 │ ╱   │
///   every three                                 1 ── 3 ── 5                 0 ─── 3
/// ```
///
/// | triangle `i` | vertices, in winding order | provoking: first | provoking: last |
/// | --- | --- | --- | --- |
/// | list | 3i, 3i + 1, 3i + 2 | 3i | 3i + 2 |
/// | strip, `i` even | i, i + 1, i + 2 | i | i + 2 |
/// | strip, `i` odd | i, i + 2, i + 1 | i | i + 2 |
/// | fan | i + 1, i + 2, 0 | i + 1 | i + 2 |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Topology {
    /// Three vertices a triangle.
    #[default]
    List,
    /// Each vertex after the second makes a triangle with the two before it.
    Strip,
    /// Each vertex after the second makes a triangle with the one before it and the first.
    Fan,
}

/// A type of vertex index: `u8`, `u16` or `u32`. The trait is sealed: an index is looked up again when its triangle is drawn, and has
/// to be the same then, of which no other type could be trusted.
///
/// ```compile_fail
/// #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
/// struct Mine(u32);
///
/// impl halfplane::Index for Mine {
///     const RESTART: Self = Self(u32::MAX);
///
///     fn to_usize(self) -> usize {
///         self.0 as usize
///     }
/// }
/// ```
pub trait Index: Copy + PartialEq + Ord + core::fmt::Debug + sealed::Sealed {
    /// The index that restarts a strip or fan: all bits set.
    const RESTART: Self;

    /// As an index into a slice; saturates where `usize` has 16 bits.
    fn to_usize(self) -> usize;
}

mod sealed {
    pub trait Sealed {}

    impl Sealed for u8 {}
    impl Sealed for u16 {}
    impl Sealed for u32 {}
}

impl Index for u8 {
    const RESTART: Self = Self::MAX;

    #[inline(always)]
    fn to_usize(self) -> usize {
        usize::from(self)
    }
}

impl Index for u16 {
    const RESTART: Self = Self::MAX;

    #[inline(always)]
    fn to_usize(self) -> usize {
        usize::from(self)
    }
}

impl Index for u32 {
    const RESTART: Self = Self::MAX;

    #[inline(always)]
    fn to_usize(self) -> usize {
        usize::try_from(self).unwrap_or(usize::MAX)
    }
}

/// Indices that are looked through once, and not in every draw.
///
/// A draw [by indices](Primitives::indexed) goes through them twice: to see that all are in range, before it draws anything,
/// and to draw. Of a mesh that is drawn again and again, the largest index can be known before. With too few vertices, a
/// draw [by an index buffer](Primitives::indexed_by) gives the same error as by its indices.
///
/// `S` holds the indices: a `Vec`, an array, or a reference to either. It should give the same ones whenever it is asked; if
/// it does not, what triangles with an index out of range draw is not specified, but nothing panics.
///
/// # Examples
/// ```
/// use halfplane::{IndexBuffer, Primitives};
///
/// struct Mesh { indices: IndexBuffer<Vec<u16>> }
///
/// let mesh = Mesh { indices: IndexBuffer::new(vec![0, 1, 2, 2, 1, 3]) };
/// let in_every_frame = Primitives::list().indexed_by(&mesh.indices);
/// assert_eq!(in_every_frame.triangle_count(4), 2);
///
/// static QUAD: [u8; 6] = [0, 1, 2, 2, 1, 3];
/// let quad = IndexBuffer::new(&QUAD);
/// assert_eq!(Primitives::list().indexed_by(&quad).triangle_count(4), 2);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct IndexBuffer<S> {
    indices: S,
    enough: Enough,
}

/// How many vertices are enough for all indices: for all but those of restarts, and for all.
#[derive(Clone, Copy, Debug)]
struct Enough {
    restarting: usize,
    plain: usize,
}

impl Enough {
    /// Nobody has looked.
    const UNKNOWN: Self = Self { restarting: usize::MAX, plain: usize::MAX };
}

impl<S> IndexBuffer<S> {
    /// Looks through indices.
    #[must_use]
    pub fn new<I: Index>(indices: S) -> Self
    where
        S: AsRef<[I]>,
    {
        let all = indices.as_ref().iter().copied();
        let enough = |largest: Option<I>| largest.map_or(0, |index| index.to_usize().saturating_add(1));
        let restarting = enough(all.clone().filter(|index| *index != I::RESTART).max());
        let enough = Enough { restarting, plain: enough(all.max()) };
        Self { indices, enough }
    }

    /// The indices.
    #[must_use]
    pub fn indices<I: Index>(&self) -> &[I]
    where
        S: AsRef<[I]>,
    {
        self.indices.as_ref()
    }

    /// What holds the indices.
    #[must_use]
    pub fn into_inner(self) -> S {
        self.indices
    }
}

/// What to draw: a topology, and the indices if there are any.
///
/// # Examples
/// ```
/// use halfplane::Primitives;
/// let every_three_vertices = Primitives::list();
/// let quad = Primitives::strip().indexed(&[0u8, 1, 3, 2]);
/// let two_fans = Primitives::fan().indexed(&[0u16, 1, 2, 3, u16::MAX, 4, 5, 6]).with_restart();
/// # let _ = (every_three_vertices, quad, two_fans);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Primitives<'a, I = u32> {
    pub(crate) topology: Topology,
    pub(crate) indices: Option<&'a [I]>,
    pub(crate) restart: bool,
    enough: Enough,
    /// Which of the triangles: `first .. end`.
    first: usize,
    end: usize,
}

impl Primitives<'static> {
    /// Unindexed triangles of any topology, for a choice made at run time.
    #[must_use]
    pub const fn new(topology: Topology) -> Self {
        Self { topology, indices: None, restart: false, enough: Enough::UNKNOWN, first: 0, end: usize::MAX }
    }

    /// Every three vertices make a triangle.
    #[must_use]
    pub const fn list() -> Self {
        Self::new(Topology::List)
    }

    /// See [`Topology::Strip`].
    #[must_use]
    pub const fn strip() -> Self {
        Self::new(Topology::Strip)
    }

    /// See [`Topology::Fan`].
    #[must_use]
    pub const fn fan() -> Self {
        Self::new(Topology::Fan)
    }
}

impl<I> Primitives<'_, I> {
    /// Takes the vertices in the order of these indices. (If they are drawn again and again: see [`IndexBuffer`].)
    #[must_use]
    pub const fn indexed<J: Index>(self, indices: &[J]) -> Primitives<'_, J> {
        let Self { topology, restart, first, end, .. } = self;
        Primitives { topology, indices: Some(indices), restart, enough: Enough::UNKNOWN, first, end }
    }

    /// Takes the vertices in the order of an [`IndexBuffer`]'s indices.
    #[must_use]
    pub fn indexed_by<J: Index, S: AsRef<[J]>>(self, buffer: &IndexBuffer<S>) -> Primitives<'_, J> {
        Primitives { enough: buffer.enough, ..self.indexed(buffer.indices()) }
    }

    /// Lets the index with all bits set end a strip or fan (or an unfinished triangle of a list) and start another.
    /// Unindexed vertices never restart.
    #[must_use]
    pub const fn with_restart(mut self) -> Self {
        self.restart = true;
        self
    }

    /// Only triangles `first .. end` of these, to be drawn or prepared by one thread of several.
    ///
    /// Numbers and everything else that a triangle knows stay those of the whole; parts one after the other draw what
    /// the whole draws. A range that reaches past the last triangle ends there. Of a part, it takes what lies in both.
    ///
    /// Where a part starts is computed; with [restarts](Self::with_restart) it is counted from the first index. An index out
    /// of range is an error of the parts that it lies in, with restarts of all.
    ///
    /// ```
    /// # use glam::Vec4;
    /// # use halfplane::{Primitives, Rasterizer, Surface, Viewport};
    /// # let positions = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| Vec4::new(x, y, 0.5, 1.0));
    /// let mut numbers = [0; 64 * 64];
    /// let mut target = Surface::color_only(&mut numbers, 64, 64)?;
    /// let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// let second = Primitives::strip().part(1, 2);
    /// let drawn = rasterizer.draw(&mut target, second, &positions, (), |fragment| fragment.primitive_index())?;
    /// assert_eq!(drawn.primitives, 1);
    /// assert!(numbers[64 * 64 - 1] == 1); // of the frame's two halves, the right one
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub const fn part(mut self, first: usize, end: usize) -> Self {
        self.first = if first > self.first { first } else { self.first };
        self.end = if end < self.end { end } else { self.end };
        self
    }
}

impl<I: Index> Primitives<'_, I> {
    /// How many triangles `vertices` vertices make; with indices, how many those make.
    ///
    /// ```
    /// # use halfplane::Primitives;
    /// assert_eq!(Primitives::list().triangle_count(7), 2);
    /// assert_eq!(Primitives::strip().indexed(&[0u8, 1, 2, 1]).triangle_count(3), 2);
    /// assert_eq!(Primitives::fan().part(1, 9).triangle_count(5), 2);
    /// ```
    #[must_use]
    pub fn triangle_count(&self, vertices: usize) -> usize {
        if self.restarts() {
            return self.triangles(vertices).count();
        }
        let len = self.indices.map_or(vertices, <[I]>::len);
        let all = if self.topology == Topology::List { len / 3 } else { len.saturating_sub(2) };
        all.min(self.end).saturating_sub(self.first)
    }

    #[inline(always)]
    fn restarts(&self) -> bool {
        self.restart && self.indices.is_some()
    }

    /// Where the vertices of these triangles stand in the sequence of `len`: from one position to before another, and for
    /// a fan at its start as well.
    #[inline(always)]
    fn used(&self, len: usize) -> (usize, usize) {
        let (start, end) = match self.topology {
            _ if self.restarts() => (0, len),
            Topology::List => (self.first.saturating_mul(3), self.end.saturating_mul(3)),
            Topology::Strip => (self.first, self.end.saturating_add(2)),
            Topology::Fan => (self.first.saturating_add(1), self.end.saturating_add(2)),
        };
        if self.first < self.end { (start.min(len), end.min(len)) } else { (0, 0) }
    }

    /// The first position at which an index is out of range for `vertices` vertices, and that index.
    #[inline(always)]
    pub(crate) fn first_out_of_range(&self, vertices: usize) -> Option<(usize, usize)> {
        let all = self.indices?;
        let enough = if self.restart { self.enough.restarting } else { self.enough.plain };
        if enough <= vertices && enough < usize::MAX {
            return None;
        }
        let (start, end) = self.used(all.len());
        if self.topology == Topology::Fan && !self.restart && start > 0 && start.saturating_add(1) < end {
            let hub = all.first()?.to_usize();
            if hub >= vertices {
                return Some((0, hub));
            }
        }
        let indices = all.get(start..end)?;
        let is_restart = |index: &I| self.restart && *index == I::RESTART;
        // The largest first: a reduction without exits is a few instructions for many indices.
        let largest = if self.restart {
            indices.iter().copied().filter(|index| !is_restart(index)).max()?
        } else {
            indices.iter().copied().max()?
        };
        if largest.to_usize() < vertices {
            return None;
        }
        let is_wrong = |index: &I| !is_restart(index) && index.to_usize() >= vertices;
        let at = indices.iter().position(is_wrong)?;
        Some((start + at, indices.get(at)?.to_usize()))
    }
}

impl<'a, I: Index> Primitives<'a, I> {
    /// The triangles that `vertices` vertices make, in order.
    #[inline(always)]
    pub(crate) fn triangles(mut self, vertices: usize) -> Triangles<'a, I> {
        self.restart = self.restarts();
        let len = self.indices.map_or(vertices, <[I]>::len);
        let (start, end) = self.used(len);
        let left = self.end.saturating_sub(self.first);
        let mut triangles =
            Triangles { primitives: self, next: start, len: end, held: [0; 2], count: 0, left: usize::MAX };
        if self.topology != Topology::List || self.restart {
            triangles.seek(self.first);
        }
        triangles.left = left;
        triangles
    }
}

/// One triangle's vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Triangle {
    /// Vertex numbers in winding order, the first of which is the first provoking vertex; and which of the three is the last
    /// provoking vertex. (Four numbers: so an index of two bits needs no check.)
    numbers: [usize; 4],
}

impl Triangle {
    #[inline(always)]
    pub(crate) const fn new([a, b, c]: [usize; 3], last_provoking: u8) -> Self {
        Self { numbers: [a, b, c, last_provoking as usize] }
    }

    /// Vertex numbers in winding order. The first is the first provoking vertex.
    #[inline(always)]
    pub(crate) fn vertices(&self) -> [usize; 3] {
        let [a, b, c, _] = self.numbers;
        [a, b, c]
    }

    /// Which of the three is the last provoking vertex.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "0 to 2")]
    pub(crate) fn last_provoking(&self) -> u8 {
        self.numbers[3] as u8
    }
}

/// Triangles that follow one another. Those of a list with indices and without restarts are looked up where they come from; others
/// are kept. (Of a fine mesh, most are looked at once, and to keep a triangle takes as long as to fetch two of its corners.)
#[derive(Debug)]
pub(crate) struct Group<'a, I, const N: usize> {
    /// Their indices, three a triangle; none if they are kept.
    listed: &'a [I],
    /// The triangles themselves, if they are not listed.
    kept: [Triangle; N],
}

impl<'a, I: Index, const N: usize> Group<'a, I, N> {
    /// No triangle.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { listed: &[], kept: [Triangle::new([0; 3], 0); N] }
    }

    /// One vertex of a triangle in winding order, `which` is 0 to 2.
    #[inline(always)]
    fn vertex(&self, triangle: usize, which: u8) -> usize {
        // No branch depends on `which`: no predictor knows the order of vertices. Whether they are listed is the same all along.
        match self.listed.get(3 * triangle + usize::from(which)) {
            Some(index) => index.to_usize(),
            None => self.kept.get(triangle).map_or(0, |kept| kept.numbers[usize::from(which & 3)]),
        }
    }

    /// A triangle's vertices, `order[i]` for each i.
    #[inline(always)]
    pub(crate) fn in_order(&self, triangle: usize, [a, b, c]: &[u8; 3]) -> [usize; 3] {
        each([a, b, c], |&which| self.vertex(triangle, which))
    }

    /// Which of its vertices is the last provoking one.
    #[inline(always)]
    pub(crate) fn last_provoking(&self, triangle: usize) -> u8 {
        if self.listed.is_empty() { self.kept.get(triangle).map_or(2, Triangle::last_provoking) } else { 2 }
    }

    /// A triangle.
    #[inline(always)]
    pub(crate) fn triangle(&self, triangle: usize) -> Triangle {
        Triangle::new(self.in_order(triangle, &[0, 1, 2]), self.last_provoking(triangle))
    }
}

/// Iterator over the triangles of [`Primitives`].
#[derive(Clone, Debug)]
pub(crate) struct Triangles<'a, I> {
    primitives: Primitives<'a, I>,
    /// The next position in the sequence of vertices, and its length.
    next: usize,
    len: usize,
    /// The two vertices that the next triangle may need, and how many came since the start or the last restart.
    held: [usize; 2],
    count: usize,
    /// How many more to make, of other than plain lists.
    left: usize,
}

impl<I: Index> Triangles<'_, I> {
    /// The number of the first triangle, modulo 2³² as documented.
    #[expect(clippy::cast_possible_truncation, reason = "that is what modulo means")]
    pub(crate) fn first_number(&self) -> u32 {
        self.primitives.first as u32
    }

    /// Goes to triangle `first` from the start.
    fn seek(&mut self, first: usize) {
        if self.primitives.restart {
            // Only counting tells.
            for _ in 0..first {
                if self.next().is_none() {
                    return;
                }
            }
        } else {
            // As if the vertices before had been read.
            let hub = if self.primitives.topology == Topology::Fan { 0 } else { first };
            self.next = hub;
            let Some(a) = self.vertex().flatten() else { return };
            self.next = first.saturating_add(1);
            let Some(b) = self.vertex().flatten() else { return };
            self.held = [a, b];
            self.count = first.saturating_add(2);
        }
    }

    /// The next vertex of the sequence: `Some(None)` for a restart.
    #[inline(always)]
    fn vertex(&mut self) -> Option<Option<usize>> {
        let at = self.next;
        if at >= self.len {
            return None;
        }
        self.next += 1;
        let Some(indices) = self.primitives.indices else { return Some(Some(at)) };
        let index = *indices.get(at)?;
        Some(if self.primitives.restart && index == I::RESTART { None } else { Some(index.to_usize()) })
    }
}

impl<'a, I: Index> Triangles<'a, I> {
    /// Takes the next triangles into `group` and hands on the vertices of each, with its slot, until there are no more of
    /// either, or the group is full. Gives how many triangles they are.
    #[inline(always)]
    pub(crate) fn take_group<S, const N: usize>(
        &mut self,
        group: &mut Group<'a, I, N>,
        slots: impl ExactSizeIterator<Item = S>,
        mut take: impl FnMut(S, [usize; 3]),
    ) -> usize {
        let is_list = self.primitives.topology == Topology::List && !self.primitives.restart;
        if let (true, Some(indices)) = (is_list, self.primitives.indices) {
            let count = slots.len().min(N).min((self.len - self.next) / 3);
            let indices = indices.get(self.next..self.next + 3 * count).unwrap_or_default();
            group.listed = indices;
            self.next += 3 * count;
            if !HAS_FLOAT_LANES {
                // In chunks, which LLVM does not inline where it optimises for size, it would divide by what might be zero, for
                // all that it knows. Where there is SIMD, this is slower.
                let mut rest = indices;
                for slot in slots {
                    let Some((&[a, b, c], after)) = rest.split_first_chunk() else { break };
                    take(slot, [a.to_usize(), b.to_usize(), c.to_usize()]);
                    rest = after;
                }
                return count;
            }
            for (slot, indices) in slots.zip(indices.chunks_exact(3)) {
                if let &[a, b, c] = indices {
                    take(slot, [a.to_usize(), b.to_usize(), c.to_usize()]);
                }
            }
            return count;
        }
        group.listed = &[];
        let mut count = 0;
        for (kept, slot) in group.kept.iter_mut().zip(slots) {
            let Some(triangle) = self.next() else { break };
            *kept = triangle;
            take(slot, triangle.vertices());
            count += 1;
        }
        count
    }
}

impl<I: Index> Iterator for Triangles<'_, I> {
    type Item = Triangle;

    #[inline(always)]
    fn next(&mut self) -> Option<Triangle> {
        // The common case needs none of the state below.
        if self.primitives.topology == Topology::List && !self.primitives.restart {
            if self.len - self.next < 3 {
                return None;
            }
            let at = self.next;
            self.next += 3;
            let vertices = match self.primitives.indices {
                None => [at, at + 1, at + 2],
                Some(indices) => match indices.get(at..at + 3)? {
                    &[a, b, c] => [a.to_usize(), b.to_usize(), c.to_usize()],
                    _ => return None,
                },
            };
            return Some(Triangle::new(vertices, 2));
        }
        if self.left == 0 {
            return None;
        }
        loop {
            let Some(vertex) = self.vertex()? else {
                self.count = 0;
                continue;
            };
            let count = self.count;
            self.count += 1;
            let [a, b] = self.held;
            match count {
                0 => self.held = [vertex, vertex],
                1 => self.held = [a, vertex],
                _ => {
                    let (vertices, last_provoking, held) = match self.primitives.topology {
                        Topology::List => {
                            self.count = 0;
                            ([a, b, vertex], 2, [a, b])
                        }
                        Topology::Strip if count % 2 == 0 => ([a, b, vertex], 2, [b, vertex]),
                        Topology::Strip => ([a, vertex, b], 1, [b, vertex]),
                        Topology::Fan => ([b, vertex, a], 1, [a, vertex]),
                    };
                    self.held = held;
                    self.left = self.left.saturating_sub(1);
                    return Some(Triangle::new(vertices, last_provoking));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// The vertices of every triangle, and its two provoking vertices.
    fn triangles<I: Index>(
        primitives: Primitives<'_, I>,
        vertices: usize,
    ) -> Vec<([usize; 3], usize, usize)> {
        let all: Vec<_> = primitives.triangles(vertices).collect();
        let (mut grouped, mut group, mut rest) =
            (Vec::new(), Group::<I, 3>::new(), primitives.triangles(vertices));
        loop {
            let mut slots = [[0; 3]; 4];
            let count = rest.take_group(&mut group, slots.iter_mut(), |slot, vertices| *slot = vertices);
            for (i, &[a, b, c]) in slots[..count].iter().enumerate() {
                assert_eq!(group.in_order(i, &[1, 2, 0]), [b, c, a], "as handed on: {primitives:?}");
                grouped.push(group.triangle(i));
            }
            if count < 3 {
                break;
            }
        }
        assert_eq!(grouped, all, "three at a time: {primitives:?} of {vertices}");
        let named =
            |t: Triangle| (t.vertices(), t.vertices()[0], t.vertices()[usize::from(t.last_provoking())]);
        all.into_iter().map(named).collect()
    }

    #[test]
    fn orders_and_provoking_vertices_are_vulkans() {
        assert_eq!(triangles(Primitives::list(), 7), [([0, 1, 2], 0, 2), ([3, 4, 5], 3, 5)], "one left over");
        assert_eq!(
            triangles(Primitives::strip(), 5),
            [([0, 1, 2], 0, 2), ([1, 3, 2], 1, 3), ([2, 3, 4], 2, 4)],
            "strip"
        );
        assert_eq!(triangles(Primitives::fan(), 4), [([1, 2, 0], 1, 2), ([2, 3, 0], 2, 3)], "fan");
        for primitives in [Primitives::list(), Primitives::strip(), Primitives::fan()] {
            assert!((0..3).all(|n| triangles(primitives, n).is_empty()), "fewer than three vertices");
        }
    }

    #[test]
    fn a_restart_forgets_the_unfinished_and_the_parity() {
        let indices = [0u8, 1, 2, 3, 255, 4, 5, 255, 6, 7, 8];
        let strip = Primitives::strip().indexed(&indices).with_restart();
        assert_eq!(
            triangles(strip, 9),
            [([0, 1, 2], 0, 2), ([1, 3, 2], 1, 3), ([6, 7, 8], 6, 8)],
            "two vertices make nothing, and the third strip starts even"
        );
        let fan = Primitives::fan().indexed(&indices).with_restart();
        assert_eq!(triangles(fan, 9), [([1, 2, 0], 1, 2), ([2, 3, 0], 2, 3), ([7, 8, 6], 7, 8)], "fan");
        let list = Primitives::list().indexed(&[0u16, 1, u16::MAX, 2, 3, 4, 5]).with_restart();
        assert_eq!(triangles(list, 6), [([2, 3, 4], 2, 4)], "list");
    }

    #[test]
    fn parts_one_after_the_other_are_the_whole() {
        fn check<I: Index>(primitives: Primitives<'_, I>, vertices: usize) {
            let whole = triangles(primitives, vertices);
            assert_eq!(primitives.triangle_count(vertices), whole.len(), "{primitives:?} of {vertices}");
            for size in 1..=whole.len() + 1 {
                let mut parts = Vec::new();
                for first in (0..whole.len() + 2).step_by(size) {
                    let part = primitives.part(first, first + size);
                    let count = parts.len();
                    parts.extend(triangles(part, vertices));
                    assert_eq!(part.triangle_count(vertices), parts.len() - count, "{part:?} of {vertices}");
                    assert_eq!(
                        part.triangles(vertices).first_number() as usize,
                        first,
                        "the number of its first triangle"
                    );
                }
                assert_eq!(parts, whole, "{primitives:?} of {vertices} in parts of {size}");
            }
        }
        let indices = [0u8, 1, 2, 3, 255, 4, 5, 255, 6, 7, 8, 6, 7, 2, 255, 9];
        for primitives in [Primitives::list(), Primitives::strip(), Primitives::fan()] {
            for count in 0..9 {
                check(primitives, count);
                check(primitives.with_restart(), count);
                check(primitives.indexed(&[5u16, 4, 9, 2, 7, 8, 9, 2, 3][..count]), 10);
            }
            check(primitives.indexed(&indices).with_restart(), 10);
        }
        let part = Primitives::list().part(2, 8).part(1, 5);
        assert_eq!(triangles(part, 100), triangles(Primitives::list().part(2, 5), 100), "a part of a part");
        let none = Primitives::strip().part(5, 2);
        assert_eq!((triangles(none, 100).len(), none.triangle_count(100)), (0, 0), "an empty range");
        let last = Primitives::fan().part(usize::MAX - 1, usize::MAX);
        assert_eq!((triangles(last, 100).len(), last.triangle_count(100)), (0, 0), "past the end");
    }

    #[test]
    fn a_part_looks_at_its_own_indices_only() {
        let list = Primitives::list().indexed(&[9u8, 0, 1, 0, 1, 2, 0, 9, 2]);
        assert_eq!(list.part(1, 2).first_out_of_range(3), None, "all in range");
        assert_eq!(list.part(1, 3).first_out_of_range(3), Some((7, 9)), "positions are those of the whole");
        let fan = Primitives::fan().indexed(&[9u8, 0, 1, 0, 1, 2]);
        assert_eq!(fan.part(2, 3).first_out_of_range(3), Some((0, 9)), "a fan's hub is in every part");
        assert_eq!(fan.part(4, 9).first_out_of_range(3), None, "no triangle, no hub");
    }

    #[test]
    fn a_buffer_finds_what_its_indices_find() {
        fn check<I: Index>(indices: &[I]) {
            let buffer = IndexBuffer::new(indices);
            for primitives in [Primitives::list(), Primitives::fan()] {
                let (looked, known) = (primitives.indexed(indices), primitives.indexed_by(&buffer));
                for vertices in (0..12).chain([255, 256, 65_535, 65_536, usize::MAX]) {
                    for (looked, known) in [
                        (looked, known),
                        (looked.part(1, 2), known.part(1, 2)),
                        (looked.with_restart(), known.with_restart()),
                    ] {
                        let found = known.first_out_of_range(vertices);
                        assert_eq!(found, looked.first_out_of_range(vertices), "{indices:?} of {vertices}");
                    }
                }
                let enough = buffer.enough.restarting;
                assert_eq!(known.with_restart().first_out_of_range(enough), None, "enough: {indices:?}");
            }
        }
        check::<u8>(&[]);
        check(&[9u8, 0, 1, 0, 1, 2, 0, 9, 2]);
        check(&[0u8, 1, 2, 255, 3, 4, 254]);
        check(&[0u16, 7, 2, 65_535, 3, 4, 5]);
        check(&[3u32, 1, 2, u32::MAX, 3, 4]);
        check(&[u32::MAX; 3]);
        assert_eq!(IndexBuffer::new([255u8, 255]).enough.restarting, 0, "restarts alone");
        // What is known of other indices is not carried over.
        let buffer = IndexBuffer::new([0u8, 1, 2]);
        let other = Primitives::list().indexed_by(&buffer).indexed(&[0u8, 9, 2]);
        assert_eq!(other.first_out_of_range(3), Some((1, 9)), "indexed after indexed_by");
    }

    #[test]
    fn an_index_out_of_range_is_found_with_its_position() {
        let list = Primitives::list().indexed(&[0u32, 1, 2, 9, 1, u32::MAX]);
        assert_eq!(list.first_out_of_range(3), Some((3, 9)), "the first of two");
        assert_eq!(list.with_restart().first_out_of_range(10), None, "a restart is not an index");
        assert_eq!(list.first_out_of_range(10).map(|(at, _)| at), Some(5), "but it is one without restart");
        assert_eq!(Primitives::list().first_out_of_range(0), None, "unindexed");
    }
}
