//! The geometry half of a draw: from vertices to pieces of triangles that may be seen.
//!
//! A triangle is projected, clipped if it must be, culled by the sign of its exact area, and dropped when its bounding box
//! holds no sample, or up to two by two none of which it covers. All of that comes before the first division: of a fine
//! mesh, most triangles end here. With those that are left goes what was found out about them.

#![expect(clippy::cast_possible_truncation, reason = "places in a batch are under 2⁶")]

use crate::behind::{Sight, keep_seen};
use crate::facing::Facing;
use crate::fan::{Fan, Piece};
use crate::fragment::Identity;
use crate::primitive::{Group, Index, Triangle, Triangles};
use crate::project::{Positions, ProjectedVertex, Projector, is_invalid};
use crate::setup::{ORDERS, Setup, sample_bounds, signed_area2};
use crate::sieve::{BATCH, Sieve, knows_outlines};
use crate::state::Statistics;
use crate::target::{Borders, Rect};
use crate::tiny::Outline;
use crate::triple::each;

/// The corners of a triangle that is one point. (A call: so LLVM leaves the way to it as a branch that is never taken, instead of
/// choosing between each vertex and none.)
#[cold]
#[inline(never)]
fn no_corners() -> [[i32; 2]; 3] {
    [[0; 2]; 3]
}

/// Where vertices come from.
#[derive(Debug)]
struct Vertices<P> {
    positions: P,
    projector: Projector,
    /// Strips, fans and tidy meshes name a vertex again at once: the triangle before is all the cache they need.
    before: [(usize, ProjectedVertex); 3],
}

impl<P: Positions> Vertices<P> {
    /// A triangle's vertices on the subpixel grid.
    #[inline(always)]
    fn corners(&mut self, vertices: [usize; 3]) -> [ProjectedVertex; 3] {
        if P::ARE_PROJECTED {
            let projected = self.positions.projected();
            return each(vertices, |index| *projected.get(index).unwrap_or(&ProjectedVertex::BLANK));
        }
        let corners = each(
            vertices,
            #[cfg_attr(feature = "dispatch", inline(always))]
            |index| {
                for (i, vertex) in self.before {
                    if i == index {
                        return vertex;
                    }
                }
                let Some(position) = self.positions.clip(index) else { return ProjectedVertex::default() };
                self.projector.project(position)
            },
        );
        let ([i, j, k], [a, b, c]) = (vertices, corners);
        self.before = [(i, a), (j, b), (k, c)];
        corners
    }
}

/// Iterates over the pieces of a draw.
///
/// Triangles come in batches, which go through the [sieve](Sieve). Those that are left are drawn.
#[derive(Debug)]
pub(crate) struct Geometry<'a, I, P> {
    triangles: Triangles<'a, I>,
    vertices: Vertices<P>,
    facing: Facing,
    /// The render area.
    area: Borders,
    /// The triangles of the batch.
    group: Group<'a, I, BATCH>,
    /// What was found out about them.
    sieve: Sieve,
    /// The number of the first one. (Declared behind the sieve: before it, W3 and W4 took 1.5 % more instructions, for no other reason
    /// than what LLVM makes of the order.)
    primitive: u32,
    /// Where what is rare leaves its result. If it returned that, the usual result would have to go through memory, too.
    aside: Piece,
    /// Where in the batch the piece that came last stands.
    lane: usize,
    pub(crate) statistics: Statistics,
}

impl<'a, I: Index, P: Positions> Geometry<'a, I, P> {
    /// (A call: what it gives is large, and is made where it will stay. Inlined, it changes the loops behind it, for the worse.)
    #[inline(never)]
    pub(crate) fn new(
        triangles: Triangles<'a, I>,
        positions: P,
        projector: Projector,
        facing: Facing,
        area: Rect,
    ) -> Self {
        Self {
            group: Group::new(),
            sieve: Sieve::new(),
            primitive: triangles.first_number(),
            triangles,
            vertices: Vertices {
                positions,
                projector,
                before: [(usize::MAX, ProjectedVertex::default()); 3],
            },
            facing,
            area: area.borders(),
            aside: Piece::BLANK,
            lane: 0,
            statistics: Statistics::default(),
        }
    }

    /// Takes in the next batch. False when there are no more triangles.
    #[inline(always)]
    pub(crate) fn refill(&mut self) -> bool {
        self.primitive = self.primitive.wrapping_add(self.sieve.count() as u32);
        let Self { triangles, vertices, group, sieve, .. } = self;
        let slots = sieve.slots();
        let count = if P::ARE_PROJECTED {
            let projected = vertices.positions.projected();
            triangles.take_group(group, slots, |((a, b), c), [i, j, k]| {
                // Indices were checked before. If one is out of range all the same, the triangle is one point, and is dropped.
                let mut point = || [*a, *b, *c] = no_corners();
                let Some(i) = projected.get(i) else { return point() };
                let Some(j) = projected.get(j) else { return point() };
                let Some(k) = projected.get(k) else { return point() };
                (*a, *b, *c) = (i.xy(), j.xy(), k.xy());
            })
        } else {
            triangles.take_group(
                group,
                slots,
                #[cfg_attr(feature = "dispatch", inline(always))]
                |((a, b), c), triangle| {
                    [*a, *b, *c] = each(vertices.corners(triangle), ProjectedVertex::xy);
                },
            )
        };
        self.statistics.primitives += count as u64;
        sieve.sift::<P>(count, self.facing, self.area, &mut self.statistics);
        count > 0
    }

    /// About where those triangles of the batch lie that may be seen, if it is worth fetching their pixels together.
    #[inline(always)]
    pub(crate) fn neighbourhood(&self) -> Option<Borders> {
        Some(self.sieve.neighbourhood()?.intersection(self.area))
    }

    /// Leaves out triangles of the batch, none of which was drawn yet, that are behind what is there: see [`keep_seen`].
    #[inline(always)]
    pub(crate) fn leave_out(&mut self, mut look: impl FnMut([ProjectedVertex; 3], Borders) -> Sight) {
        let mut queue = self.sieve.queue;
        keep_seen(
            &mut queue,
            #[cfg_attr(feature = "dispatch", inline(always))]
            |lane| {
                if self.sieve.verdict(lane).is_undecided() {
                    return Sight::Unknown;
                }
                let corners @ [a, b, c] = self.vertices.corners(self.group.in_order(lane, &[0, 1, 2]));
                let bounds = if const { knows_outlines::<P>() } {
                    self.sieve.bounds(lane)
                } else {
                    sample_bounds(a, b, c)
                };
                look(corners, bounds)
            },
        );
        self.sieve.queue = queue;
    }

    /// The batch's next piece. `fan` is where it keeps what is left of a clipped triangle; it starts empty.
    #[inline(always)]
    pub(crate) fn next(&mut self, fan: &mut Option<Fan>) -> Option<Piece> {
        loop {
            if fan.is_some() {
                if self.next_of_fan(fan) {
                    return Some(self.aside);
                }
                continue;
            }
            let lane = self.sieve.queue.pop()? & (BATCH - 1);
            self.lane = lane;
            let verdict = self.sieve.verdict(lane);
            let number = self.primitive.wrapping_add(lane as u32);
            let (setup, vertices) = if !verdict.is_undecided() {
                let place = verdict.order();
                let order = ORDERS.get(place)?;
                let vertices = self.group.in_order(lane, order);
                (Setup::of_corners(self.vertices.corners(vertices), place as u8), vertices)
            } else {
                let triangle = self.group.triangle(lane);
                if !self.look_closer(triangle, number, fan) {
                    continue;
                }
                let setup = self.aside.setup;
                (setup, self.group.in_order(lane, &setup.order()))
            };
            let covered = self.within(&setup, verdict.covered());
            return Some(Piece { setup, vertices, primitive: number, in_fan: 0, covered });
        }
    }

    /// Who a piece is, which has to be of this batch. (No part of the piece: few closures ask.)
    #[inline(always)]
    pub(crate) fn identity(&self, piece: &Piece) -> Identity {
        let (lane, count) = (piece.primitive.wrapping_sub(self.primitive) as usize, self.sieve.count());
        debug_assert!(lane < count, "{piece:?} is not of the {count} in the batch");
        let last_provoking = self.group.last_provoking(lane);
        self.facing.identity(last_provoking, piece.setup.is_counter_clockwise(), piece.primitive)
    }

    /// Where the piece lies, which has to be the one that came last.
    #[inline(always)]
    pub(crate) fn outline(&self, piece: &Piece) -> Outline {
        if !const { knows_outlines::<P>() } {
            return Outline::new(&piece.setup);
        }
        let outline = self.sieve.outline(self.lane);
        debug_assert_eq!(outline, Outline::new(&piece.setup), "of another piece");
        outline
    }

    /// Finds out where the piece of a clipped triangle lies that was put aside.
    #[cold]
    #[inline(never)]
    fn outline_aside(&mut self) {
        self.sieve.set_outline(self.lane, Outline::new(&self.aside.setup));
    }

    /// Which samples are [`covered`](crate::fan::Piece::covered), or that it is not known if any of the four lies outside of
    /// the area. The sieve has seen to that; but who computes positions may give others when asked again, and must not be drawn
    /// there.
    #[inline(always)]
    fn within(&self, setup: &Setup, covered: u32) -> u32 {
        let (Borders { left, top, .. }, area) = (setup.borders(), self.area);
        let is_inside =
            (left >= area.left) & (top >= area.top) & (left < area.right - 1) & (top < area.bottom - 1);
        if P::ARE_PROJECTED || is_inside { covered } else { 0 }
    }

    /// Whether the bounding box holds a sample of the area.
    #[inline(always)]
    fn may_cover(&self, [a, b, c]: [ProjectedVertex; 3]) -> bool {
        sample_bounds(a, b, c).overlaps(self.area)
    }

    /// Puts the next piece of a clipped triangle aside. False when there is none.
    #[cold]
    #[inline(never)]
    fn next_of_fan(&mut self, fan: &mut Option<Fan>) -> bool {
        while let Some(piece) = fan.as_mut().and_then(|fan| fan.next(&self.vertices.projector)) {
            if self.may_cover(piece.setup.corners()) {
                self.aside = piece;
                if const { knows_outlines::<P>() } {
                    self.outline_aside();
                }
                return true;
            }
        }
        *fan = None;
        false
    }

    /// Decides on a triangle by integers: if it may be seen, its setup is put aside. Or clips it: then `fan` has what is
    /// left.
    #[cold]
    #[inline(never)]
    fn look_closer(&mut self, triangle: Triangle, number: u32, fan: &mut Option<Fan>) -> bool {
        let corners @ [a, b, c] = self.vertices.corners(triangle.vertices());
        if a.is_outside() | b.is_outside() | c.is_outside() {
            *fan = self.clip(triangle, corners, number);
            return false;
        }
        let area2 = signed_area2(a, b, c);
        if area2 == 0 {
            self.statistics.degenerate += 1;
        } else if self.facing.culls(area2) {
            self.statistics.culled += 1;
        } else if self.may_cover(corners) {
            self.aside.setup = Setup::with_area2(corners, area2);
            return true;
        }
        false
    }

    /// Clips and culls a triangle with a vertex outside of the clip volume.
    #[cold]
    #[inline(never)]
    fn clip(&mut self, triangle: Triangle, corners: [ProjectedVertex; 3], primitive: u32) -> Option<Fan> {
        let outcodes = each(corners, ProjectedVertex::outcode);
        let union = outcodes[0] | outcodes[1] | outcodes[2];
        let positions = each(triangle.vertices(), |index| self.vertices.positions.clip(index));
        let [Some(a), Some(b), Some(c)] = positions else { return None };
        if is_invalid(union) {
            self.statistics.invalid += 1;
            return None;
        }
        if outcodes[0] & outcodes[1] & outcodes[2] != 0 {
            self.statistics.outside += 1;
            return None;
        }
        let positions = each([a, b, c], |position| self.vertices.projector.to_clip(position));
        let fan = Fan::new(triangle.vertices(), positions, union, primitive, &self.vertices.projector);
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
        Some(fan)
    }
}
