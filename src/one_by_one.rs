//! A draw where there is no SIMD: triangle by triangle, row by row, one fragment after the other.
//!
//! Nothing is collected into batches or packets, which takes less memory and less code; and the results are the same.
//! Triangles that have to be clipped, which are few, are drawn by a function of their own: the memory for that is taken
//! only while one is drawn.

use crate::clip::{Corner, Room};
use crate::depth::{DepthBias, DepthFormat, DepthTest};
use crate::fan::{History, Piece, piece_of, polygon_area2, project_piece};
use crate::fragment::{Fragment, Identity, Pedigree, Shading};
use crate::geometry::Facing;
use crate::interpolate::Varyings;
use crate::primitive::{Index, Triangle, Triangles};
use crate::project::{Positions, ProjectedVertex, Projector, is_invalid};
use crate::setup::{Setup, sample_bounds, signed_area2};
use crate::shade::DepthPlane;
use crate::state::Statistics;
use crate::target::Framebuffer;
use crate::traverse::Solver;
use crate::triple::each;
use crate::vertex::Attributes;

/// What a draw works with.
#[derive(Debug)]
pub(crate) struct OneByOne<'a, F, T, S> {
    pub(crate) target: &'a mut F,
    /// The render area: left, top, right, bottom.
    pub(crate) area: [i32; 4],
    pub(crate) test: T,
    pub(crate) depth_bias: DepthBias,
    pub(crate) depth_limits: (f32, f32),
    pub(crate) shade: S,
    pub(crate) statistics: Statistics,
}

/// Where its triangles come from.
#[derive(Debug)]
pub(crate) struct Vertices<P, A> {
    pub(crate) positions: P,
    pub(crate) varyings: A,
    pub(crate) projector: Projector,
    pub(crate) facing: Facing,
}

impl<P: Positions, A> Vertices<P, A> {
    /// A vertex on the subpixel grid.
    fn fetch(&self, index: usize) -> ProjectedVertex {
        if P::ARE_PROJECTED {
            return self.positions.projected(index).unwrap_or_default();
        }
        self.positions.clip(index).map(|position| self.projector.project(position)).unwrap_or_default()
    }

    /// Makes of a triangle the next piece of what clipping leaves of it, if there is one.
    ///
    /// It is clipped for each piece anew: so the polygon's 280 bytes of stack are free again while one is drawn.
    #[cold]
    #[inline(never)]
    fn next_piece(
        &self,
        triangle: &Triangle,
        outcodes: Outcodes,
        piece: &mut Piece,
        statistics: &mut Statistics,
    ) -> Option<History> {
        let [Some(a), Some(b), Some(c)] = each(triangle.vertices, |index| self.positions.clip(index)) else {
            return None;
        };
        let is_first = piece.in_fan == 0;
        if is_invalid(outcodes.any) {
            statistics.invalid += u64::from(is_first);
            return None;
        }
        let positions = self.projector.triangle_to_clip([a, b, c]);
        let mut room: Room = [Corner { position: a, weights: [0.0; 3] }; 10];
        let polygon = self.projector.volume.clip(positions, outcodes.any, &mut room);
        if outcodes.all != 0 || polygon.is_empty() {
            statistics.outside += u64::from(is_first);
            return None;
        }
        let whole = polygon_area2(polygon, &self.projector);
        statistics.clipped += u64::from(is_first);
        if whole == 0 {
            statistics.degenerate += u64::from(is_first);
            return None;
        }
        if self.facing.culls(whole) {
            statistics.culled += u64::from(is_first);
            return None;
        }
        loop {
            piece.in_fan += 1;
            (piece.corners, piece.area2) = project_piece(polygon, piece.in_fan, &self.projector)?;
            // As in `Fan::next`.
            if piece.area2.signum() == whole.signum() {
                piece.identity = self.facing.identity(*triangle, whole, piece.identity.primitive);
                return Some(History::new(piece_of(polygon, piece.in_fan)?, positions));
            }
        }
    }
}

/// Which planes any and all vertices of a triangle lie outside of.
#[derive(Clone, Copy, Debug)]
struct Outcodes {
    any: u8,
    all: u8,
}

impl<F: Framebuffer, T: DepthTest, S> OneByOne<'_, F, T, S> {
    /// Draws triangles.
    #[inline(always)]
    pub(crate) fn draw_triangles<I, P, A, R>(
        &mut self,
        triangles: Triangles<'_, I>,
        vertices: &Vertices<P, A>,
    ) where
        I: Index,
        P: Positions,
        A: Attributes<Value: Varyings>,
        S: FnMut(Fragment<'_, A::Value>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let first = triangles.first_number();
        let mut number = first;
        for triangle in triangles {
            let corners @ [a, b, c] = each(triangle.vertices, |index| vertices.fetch(index));
            let area2 = signed_area2(a, b, c);
            let identity = vertices.facing.identity(triangle, area2, number);
            let mut piece = Piece { corners, area2, vertices: triangle.vertices, identity, in_fan: 0 };
            number = number.wrapping_add(1);
            if a.is_outside() | b.is_outside() | c.is_outside() {
                let (p, q, r) = (a.outcode(), b.outcode(), c.outcode());
                let outcodes = Outcodes { any: p | q | r, all: p & q & r };
                while let Some(history) =
                    vertices.next_piece(&triangle, outcodes, &mut piece, &mut self.statistics)
                {
                    self.draw_piece(&piece, Some(&history), &vertices.varyings);
                }
            } else if area2 == 0 {
                self.statistics.degenerate += 1;
            } else if vertices.facing.culls(area2) {
                self.statistics.culled += 1;
            } else {
                self.draw_piece(&piece, None, &vertices.varyings);
            }
        }
        self.statistics.primitives = u64::from(number.wrapping_sub(first));
    }

    /// Draws a triangle, or a piece of one.
    #[inline(never)]
    fn draw_piece<A, R>(&mut self, piece: &Piece, history: Option<&History>, varyings: &A)
    where
        A: Attributes<Value: Varyings>,
        S: FnMut(Fragment<'_, A::Value>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        if !self.may_cover(piece.corners) {
            return;
        }
        let [Some(a), Some(b), Some(c)] = each(piece.vertices, |index| varyings.fetch(index)) else { return };
        let setup = Setup::with_area2(piece.corners, piece.area2);
        let mut values = [a, b, c];
        if let Some(history) = history {
            history.interpolate(&mut values, piece.identity.provoking);
        }
        let pedigree = history.map(History::pedigree);
        self.draw_setup(&setup, values, piece.identity, pedigree.as_ref());
    }

    /// Whether the bounding box holds a sample of the area.
    #[inline(always)]
    fn may_cover(&self, [a, b, c]: [ProjectedVertex; 3]) -> bool {
        let ([left, top, right, bottom], area) = (sample_bounds(a, b, c), self.area);
        (left.max(area[0]) < right.min(area[2])) & (top.max(area[1]) < bottom.min(area[3]))
    }

    /// Draws a triangle that is set up.
    #[inline(always)]
    pub(crate) fn draw_setup<V, R>(
        &mut self,
        setup: &Setup,
        values: [V; 3],
        identity: Identity,
        pedigree: Option<&Pedigree>,
    ) where
        V: Varyings,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let ([a, b, c], area) = (setup.corners(), self.area);
        let [_, top, _, bottom] = sample_bounds(a, b, c);
        let (mut y, bottom) = (top.max(area[1]), bottom.min(area[3]));
        let shading = Shading::new(setup, values, identity, pedigree);
        let plane = DepthPlane::new::<F::Depth>(setup, self.depth_bias, self.depth_limits);
        let step = shading.step_x();
        let solver = Solver::new(setup);
        let (mut shaded, mut kept) = (0u32, 0u32);
        while y < bottom {
            let rows = solver.solve(y, bottom);
            let (mut x, end, anchor) = (rows.start[0].max(area[0]), rows.end[0].min(area[2]), rows.anchor[0]);
            let edges = [rows.edges[0][0], rows.edges[1][0], rows.edges[2][0]];
            let (base, z) = (shading.sample(edges), plane.at_edges(edges[0], edges[1]));
            let dx = |x: i32| x.wrapping_sub(anchor) as f32;
            // Depth is linear: inside of its limits at both ends, it needs no clamp between them. A row that leaves them
            // is drawn a pixel at a time, each with a depth of its own.
            let needs_clamp = x < end && !(plane.contains(z, dx(x)) && plane.contains(z, dx(end - 1)));
            while x < end {
                let (z, z_step, len) =
                    if needs_clamp { (plane.moved(z, dx(x)), 0.0, 1) } else { (z, plane.step_x(), end - x) };
                let run = self.target.run(x, y, len as usize);
                // No more than was asked for, if a framebuffer lends that.
                let count = run.color.len().min(run.depth.len()).min(len as usize);
                let colors = run.color.get_mut(..count).unwrap_or_default();
                let depths = run.depth.get_mut(..count).unwrap_or_default();
                let mut dx = dx(x);
                let mut at_x = x;
                for (color, depth) in colors.iter_mut().zip(depths) {
                    let z = z + z_step * dx;
                    let new = F::Depth::from_depth(z);
                    if !F::Depth::IS_STORED || self.test.passes(new, *depth) {
                        let at = base.moved(step, dx);
                        let fragment = Fragment { triangle: &shading, at, x: at_x, y, depth: z };
                        shaded += 1;
                        if let Some(result) = (self.shade)(fragment, *color).into() {
                            kept += 1;
                            *color = result;
                            if self.test.writes() {
                                *depth = new;
                            }
                        }
                    }
                    // Whole numbers: as exact as a conversion.
                    dx += 1.0;
                    at_x = at_x.wrapping_add(1);
                }
                x += len;
            }
            y += 1;
        }
        self.statistics.fragments += u64::from(shaded);
        self.statistics.samples_passed += u64::from(kept);
    }
}
