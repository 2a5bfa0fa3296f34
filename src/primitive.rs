//! Primitive assembly: which vertices make which triangle.
//!
//! Orders and provoking vertices are Vulkan's ("Primitive Topologies"): each triangle lists its vertices so that
//! neighbours in a strip or fan wind alike.

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

/// A type of vertex index: `u8`, `u16` or `u32`.
pub trait Index: Copy + PartialEq + Ord + core::fmt::Debug {
    /// The index that restarts a strip or fan: all bits set.
    const RESTART: Self;

    /// As an index into a slice; saturates where `usize` has 16 bits.
    fn to_usize(self) -> usize;
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
}

impl Primitives<'static> {
    /// Unindexed triangles of any topology, for a choice made at run time.
    #[must_use]
    pub const fn new(topology: Topology) -> Self {
        Self { topology, indices: None, restart: false }
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
    /// Takes the vertices in the order of these indices.
    #[must_use]
    pub const fn indexed<J: Index>(self, indices: &[J]) -> Primitives<'_, J> {
        Primitives { topology: self.topology, indices: Some(indices), restart: self.restart }
    }

    /// Lets the index with all bits set end a strip or fan (or an unfinished triangle of a list) and start another.
    /// Unindexed vertices never restart.
    #[must_use]
    pub const fn with_restart(mut self) -> Self {
        self.restart = true;
        self
    }
}

impl<I: Index> Primitives<'_, I> {
    /// The first position at which an index is out of range for `vertices` vertices, and that index.
    pub(crate) fn first_out_of_range(&self, vertices: usize) -> Option<(usize, usize)> {
        let indices = self.indices?;
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
        Some((at, indices.get(at)?.to_usize()))
    }
}

impl<'a, I: Index> Primitives<'a, I> {
    /// The triangles that `vertices` vertices make, in order.
    #[inline(always)]
    pub(crate) fn triangles(self, vertices: usize) -> Triangles<'a, I> {
        let len = self.indices.map_or(vertices, <[I]>::len);
        Triangles { primitives: self, next: 0, len, held: [0; 2], count: 0 }
    }
}

/// One triangle's vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Triangle {
    /// Vertex numbers in winding order. The first is the first provoking vertex.
    pub(crate) vertices: [usize; 3],
    /// Which of the three is the last provoking vertex.
    pub(crate) last_provoking: u8,
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
}

impl<I: Index> Triangles<'_, I> {
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
            return Some(Triangle { vertices, last_provoking: 2 });
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
                    return Some(Triangle { vertices, last_provoking });
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
        primitives
            .triangles(vertices)
            .map(|t| (t.vertices, t.vertices[0], t.vertices[usize::from(t.last_provoking)]))
            .collect()
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
    fn an_index_out_of_range_is_found_with_its_position() {
        let list = Primitives::list().indexed(&[0u32, 1, 2, 9, 1, u32::MAX]);
        assert_eq!(list.first_out_of_range(3), Some((3, 9)), "the first of two");
        assert_eq!(list.with_restart().first_out_of_range(10), None, "a restart is not an index");
        assert_eq!(list.first_out_of_range(10).map(|(at, _)| at), Some(5), "but it is one without restart");
        assert_eq!(Primitives::list().first_out_of_range(0), None, "unindexed");
    }
}
