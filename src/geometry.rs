//! The geometry half of a draw: from vertices to pieces of triangles that may be seen.
//!
//! A triangle is projected, clipped if it must be, culled by the sign of its exact area, and dropped when its bounding box
//! holds no sample. All of that comes before the first division: of a fine mesh, most triangles end here.

use crate::fan::{Fan, Piece};
use crate::fragment::Identity;
use crate::primitive::{Index, Triangle, Triangles};
use crate::project::{Positions, ProjectedVertex, Projector, is_invalid};
use crate::setup::{sample_bounds, signed_area2};
use crate::state::{CullMode, FrontFace, ProvokingVertex, Statistics};
use crate::target::Rect;
use crate::traverse::{HAS_FLOAT_LANES, Tiny};
use crate::triple::each;

/// Which sides of triangles are drawn, and what they are called.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    pub(crate) cull_mode: CullMode,
    pub(crate) front_face: FrontFace,
    pub(crate) provoking_vertex: ProvokingVertex,
}

impl Facing {
    #[inline(always)]
    fn is_front(self, area2: i64) -> bool {
        (area2 < 0) == (self.front_face == FrontFace::CounterClockwise)
    }

    #[inline(always)]
    pub(crate) fn culls(self, area2: i64) -> bool {
        let is_front = self.is_front(area2);
        ((self.cull_mode == CullMode::Front) & is_front) | ((self.cull_mode == CullMode::Back) & !is_front)
    }

    #[inline(always)]
    pub(crate) fn identity(self, triangle: Triangle, area2: i64, primitive: u32) -> Identity {
        let provoking = match self.provoking_vertex {
            ProvokingVertex::First => 0,
            ProvokingVertex::Last => triangle.last_provoking,
        };
        Identity { provoking, is_front_facing: self.is_front(area2), primitive }
    }
}

/// How many triangles are looked at before the first of them is drawn.
const BATCH: usize = if HAS_FLOAT_LANES { 64 } else { 4 };

/// Iterates over the pieces of a draw.
///
/// Triangles come in batches: first one tight loop that finds out, without a branch, which of a batch have to be drawn;
/// then those. Whether a triangle is culled is a coin toss that no branch predictor wins.
#[derive(Debug)]
pub(crate) struct Geometry<'a, I, P> {
    triangles: Triangles<'a, I>,
    positions: P,
    projector: Projector,
    facing: Facing,
    /// The render area: left, top, right, bottom.
    area: [i32; 4],
    /// The number of the batch's first triangle.
    primitive: u32,
    batch: [(Triangle, u32); BATCH],
    next: usize,
    len: usize,
    /// Strips, fans and tidy meshes name a vertex again at once: the triangle before is all the cache they need.
    before: [(usize, ProjectedVertex); 3],
    pub(crate) statistics: Statistics,
}

impl<'a, I: Index, P: Positions> Geometry<'a, I, P> {
    pub(crate) fn new(
        triangles: Triangles<'a, I>,
        positions: P,
        projector: Projector,
        facing: Facing,
        area: Rect,
    ) -> Self {
        let primitive = triangles.first_number();
        Self {
            triangles,
            positions,
            projector,
            facing,
            area: [area.x, area.y, area.right(), area.bottom()],
            primitive,
            batch: [(Triangle::default(), 0); BATCH],
            next: 0,
            len: 0,
            before: [(usize::MAX, ProjectedVertex::default()); 3],
            statistics: Statistics::default(),
        }
    }

    /// A triangle's vertices on the subpixel grid.
    #[inline(always)]
    fn corners(&mut self, vertices: [usize; 3]) -> [ProjectedVertex; 3] {
        if P::ARE_PROJECTED {
            return each(vertices, |index| self.positions.projected(index).unwrap_or_default());
        }
        let corners = each(vertices, |index| {
            for (i, vertex) in self.before {
                if i == index {
                    return vertex;
                }
            }
            self.positions.clip(index).map(|position| self.projector.project(position)).unwrap_or_default()
        });
        let ([i, j, k], [a, b, c]) = (vertices, corners);
        self.before = [(i, a), (j, b), (k, c)];
        corners
    }

    /// Takes a triangle into the batch, unless it is culled or cannot cover a sample.
    #[inline(always)]
    fn look_at(&mut self, triangle: Triangle, number: u32) {
        let corners @ [a, b, c] = self.corners(triangle.vertices);
        let area2 = signed_area2(a, b, c);
        let is_outside = a.is_outside() | b.is_outside() | c.is_outside();
        let is_degenerate = !is_outside & (area2 == 0);
        let is_culled = !is_outside & !is_degenerate & self.facing.culls(area2);
        self.statistics.degenerate += u64::from(is_degenerate);
        self.statistics.culled += u64::from(is_culled);
        let is_drawn = is_outside | (!is_degenerate & !is_culled & self.may_cover(corners));
        if let Some(place) = self.batch.get_mut(self.len) {
            *place = (triangle, number);
        }
        self.len += usize::from(is_drawn);
    }

    /// Fills the batch. False when there are no more triangles.
    #[inline(always)]
    fn refill(&mut self) -> bool {
        (self.next, self.len) = (0, 0);
        let first = self.primitive;
        let mut number = first;
        for _ in 0..BATCH {
            let Some(triangle) = self.triangles.next() else { break };
            self.look_at(triangle, number);
            number = number.wrapping_add(1);
        }
        self.primitive = number;
        self.statistics.primitives += u64::from(number.wrapping_sub(first));
        number != first
    }

    /// The next piece. `fan` is where it keeps what is left of a clipped triangle; it starts empty.
    #[inline(always)]
    pub(crate) fn next(&mut self, fan: &mut Option<Fan>) -> Option<Piece> {
        loop {
            if let Some(pieces) = fan {
                match pieces.next(&self.projector) {
                    Some(piece) if self.may_cover(piece.corners) => return Some(piece),
                    Some(_) => {}
                    None => *fan = None,
                }
                continue;
            }
            if self.next >= self.len {
                if !self.refill() {
                    return None;
                }
                continue;
            }
            let &(triangle, number) = self.batch.get(self.next)?;
            self.next += 1;
            let corners @ [a, b, c] = self.corners(triangle.vertices);
            if a.is_outside() | b.is_outside() | c.is_outside() {
                *fan = self.clip(triangle, corners, number);
                continue;
            }
            let area2 = signed_area2(a, b, c);
            if HAS_FLOAT_LANES && !may_cover_tiny(corners, area2) {
                continue;
            }
            let identity = self.facing.identity(triangle, area2, number);
            return Some(Piece { corners, area2, vertices: triangle.vertices, identity, in_fan: 0 });
        }
    }

    /// Whether the bounding box holds a sample of the area.
    #[inline(always)]
    fn may_cover(&self, [a, b, c]: [ProjectedVertex; 3]) -> bool {
        let ([left, top, right, bottom], area) = (sample_bounds(a, b, c), self.area);
        (left.max(area[0]) < right.min(area[2])) & (top.max(area[1]) < bottom.min(area[3]))
    }

    /// Clips and culls a triangle with a vertex outside of the clip volume.
    #[cold]
    #[inline(never)]
    fn clip(&mut self, triangle: Triangle, corners: [ProjectedVertex; 3], primitive: u32) -> Option<Fan> {
        let outcodes = each(corners, ProjectedVertex::outcode);
        let union = outcodes[0] | outcodes[1] | outcodes[2];
        let positions = each(triangle.vertices, |index| self.positions.clip(index));
        let [Some(a), Some(b), Some(c)] = positions else { return None };
        if is_invalid(union) {
            self.statistics.invalid += 1;
            return None;
        }
        if outcodes[0] & outcodes[1] & outcodes[2] != 0 {
            self.statistics.outside += 1;
            return None;
        }
        let positions = self.projector.triangle_to_clip([a, b, c]);
        let mut fan = Fan::new(triangle.vertices, positions, union, &self.projector);
        if fan.is_empty() {
            self.statistics.outside += 1;
            return None;
        }
        self.statistics.clipped += 1;
        if fan.area2() == 0 || self.facing.culls(fan.area2()) {
            let is_degenerate = fan.area2() == 0;
            let count =
                if is_degenerate { &mut self.statistics.degenerate } else { &mut self.statistics.culled };
            *count += 1;
            return None;
        }
        fan.identity = self.facing.identity(triangle, fan.area2(), primitive);
        Some(fan)
    }
}

/// Whether a triangle whose bounds hold one or two samples, or two by two, covers one of them. Others may.
///
/// Half of the triangles in the size of a pixel cover none: finding out takes less than setting them up.
#[inline(always)]
fn may_cover_tiny([a, b, c]: [ProjectedVertex; 3], area2: i64) -> bool {
    let [left, top, right, bottom] = sample_bounds(a, b, c);
    let (width, height) = (right - left, bottom - top);
    if width > 2 || height > 2 {
        return true;
    }
    let corners = if area2 > 0 { [a, b, c] } else { [a, c, b] };
    Tiny::new(corners, left, top, width).covers_any(height)
}
