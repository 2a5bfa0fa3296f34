//! A draw where there is no SIMD: triangle by triangle, row by row, one fragment after the other.
//!
//! Nothing is collected into batches or packets, which takes less memory and less code; and the results are the same.
//!
//! A microcontroller has kilobytes for its stack, and flash to spare for one copy of everything. So the frames that stand
//! on one another are few and hold nothing twice: assembly and culling, below it either clipping or traversal and shading,
//! which is the same function for a triangle and for a piece of one.

use crate::clip::{Corner, Room};
use crate::depth::{DepthBias, DepthFormat, DepthTest};
use crate::facing::Facing;
use crate::fan::{History, piece_of, project_piece, settle};
use crate::fragment::{Fragment, Identity, Shading, WeightParts, reorder};
use crate::interpolate::Varyings;
use crate::plane::{DepthPlane, RowPlane};
use crate::primitive::{Index, Triangle, Triangles};
use crate::project::{Positions, ProjectedVertex, Projector, is_invalid};
use crate::setup::{COUNTER_CLOCKWISE, ORDERS, Setup, sample_bounds, signed_area2};
use crate::state::Statistics;
use crate::target::{Borders, Framebuffer};
use crate::tiny::is_tiny;
use crate::traverse::{Compact, HAS_FPU, solve_alone};
use crate::triple::each;
use crate::vertex::Attributes;

/// What a draw works with.
#[derive(Debug)]
pub(crate) struct OneByOne<'a, F, T, S> {
    pub(crate) target: &'a mut F,
    /// The render area.
    pub(crate) area: Borders,
    pub(crate) test: T,
    pub(crate) depth_bias: Option<DepthBias>,
    pub(crate) depth_limits: (f32, f32),
    pub(crate) shade: S,
    /// How often the closure ran, and how often it discarded nothing.
    pub(crate) fragments: u64,
    pub(crate) samples_passed: u64,
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
    /// A triangle's vertices on the subpixel grid.
    #[inline(always)]
    fn fetch(&self, vertices: [usize; 3], [a, b, c]: &mut [ProjectedVertex; 3]) {
        if P::ARE_PROJECTED {
            [*a, *b, *c] =
                each(vertices, |index| self.positions.projected().get(index).copied().unwrap_or_default());
        } else {
            let [i, j, k] = vertices;
            self.project(i, a);
            self.project(j, b);
            self.project(k, c);
        }
    }

    /// Written where it shall stand: a value that is returned stands in the caller's frame first.
    #[inline(never)]
    fn project(&self, index: usize, vertex: &mut ProjectedVertex) {
        *vertex =
            self.positions.clip(index).map(|position| self.projector.project(position)).unwrap_or_default();
    }

    /// Makes of a triangle the next piece of what clipping leaves of it, and tells what has become of it otherwise.
    ///
    /// It is clipped for each piece anew: so the polygon's 280 bytes of stack are free again while one is drawn.
    #[cold]
    #[inline(never)]
    fn next_piece(&self, triangle: &Triangle, outcodes: Outcodes, part: &mut Part) -> Fate {
        if is_invalid(outcodes.any) {
            return Fate::Invalid;
        }
        if outcodes.all != 0 {
            return Fate::Outside;
        }
        let mut room: Room = [Corner { position: [1.0; 4], weights: [0.0; 3] }; 10];
        for (i, &index) in triangle.vertices().iter().enumerate() {
            let (Some(corner), Some(position)) = (room.get_mut(i), self.positions.clip(index)) else {
                return Fate::Invalid;
            };
            corner.position = self.projector.to_clip(position).to_array();
            corner.weights[i] = 1.0;
            part.history.w[i] = position.w;
        }
        let len = self.projector.volume.clip(&mut room, outcodes.any);
        let polygon = room.get_mut(..len).unwrap_or_default();
        if polygon.is_empty() {
            return Fate::Outside;
        }
        let whole = settle(polygon, &self.projector, &mut part.corners);
        if whole == 0 {
            return Fate::Degenerate;
        }
        if self.facing.culls(whole) {
            return Fate::Culled;
        }
        part.identity = self.facing.identity(triangle.last_provoking(), whole < 0, part.identity.primitive);
        loop {
            part.in_fan += 1;
            let Some(area2) = project_piece(polygon, part.in_fan, &self.projector, &mut part.corners) else {
                break;
            };
            // As in `Fan::next`.
            if area2.signum() == whole.signum() {
                part.area2 = area2;
                if let Some([a, b, c]) = piece_of(polygon, part.in_fan) {
                    part.history.weights = [a.weights, b.weights, c.weights];
                }
                return Fate::Drawn;
            }
        }
        Fate::Spent
    }
}

/// A triangle, or a piece of one that was clipped.
#[derive(Debug)]
struct Part {
    corners: [ProjectedVertex; 3],
    area2: i64,
    identity: Identity,
    /// Of a piece, its number from 1 on, and how it came about.
    in_fan: usize,
    history: History,
}

impl Part {
    /// [`Setup::with_area2`], with branches: where three corners are twelve registers, choosing them takes longer.
    #[inline(always)]
    fn setup(&self) -> Setup {
        let is_counter_clockwise = self.area2 < 0;
        let [a, b, c] = self.corners;
        let is_first =
            |v: ProjectedVertex, w: ProjectedVertex| v.y() < w.y() || (v.y() == w.y() && v.x() <= w.x());
        let first: u8 = if is_first(a, b) && is_first(a, c) {
            0
        } else if is_first(b, c) {
            1
        } else {
            2
        };
        let place = first + if is_counter_clockwise { COUNTER_CLOCKWISE } else { 0 };
        let order = ORDERS.get(usize::from(place)).copied().unwrap_or_default();
        let corners = each(order, |i| self.corners.get(usize::from(i)).copied().unwrap_or_default());
        Setup::of_corners(corners, place)
    }
}

/// What becomes of a triangle that has to be clipped.
#[derive(Clone, Copy, Debug)]
enum Fate {
    Invalid,
    Outside,
    Degenerate,
    Culled,
    /// There is a piece to be drawn.
    Drawn,
    /// There are no more.
    Spent,
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
    ) -> Statistics
    where
        I: Index,
        P: Positions,
        A: Attributes<Value: Varyings>,
        S: FnMut(Fragment<'_, A::Value>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let mut number = triangles.first_number();
        let (mut primitives, mut invalid, mut outside) = (0usize, 0usize, 0usize);
        let (mut clipped, mut culled, mut degenerate) = (0usize, 0usize, 0usize);
        let mut part = Part {
            corners: [ProjectedVertex::BLANK; 3],
            area2: 0,
            identity: Identity { provoking: 0, is_front_facing: false, primitive: 0 },
            in_fan: 0,
            history: History::WHOLE,
        };
        for triangle in triangles {
            vertices.fetch(triangle.vertices(), &mut part.corners);
            let [a, b, c] = part.corners;
            part.area2 = signed_area2(a, b, c);
            part.identity = vertices.facing.identity(triangle.last_provoking(), part.area2 < 0, number);
            part.in_fan = 0;
            number = number.wrapping_add(1);
            primitives += 1;
            if a.is_outside() | b.is_outside() | c.is_outside() {
                let (p, q, r) = (a.outcode(), b.outcode(), c.outcode());
                let outcodes = Outcodes { any: p | q | r, all: p & q & r };
                let fate = loop {
                    match vertices.next_piece(&triangle, outcodes, &mut part) {
                        Fate::Drawn => self.draw_part(&part, triangle.vertices(), &vertices.varyings),
                        fate => break fate,
                    }
                };
                match fate {
                    Fate::Invalid => invalid += 1,
                    Fate::Outside => outside += 1,
                    Fate::Degenerate => (clipped, degenerate) = (clipped + 1, degenerate + 1),
                    Fate::Culled => (clipped, culled) = (clipped + 1, culled + 1),
                    Fate::Drawn | Fate::Spent => clipped += 1,
                }
            } else if part.area2 == 0 {
                degenerate += 1;
            } else if vertices.facing.culls(part.area2) {
                culled += 1;
            } else {
                self.draw_part(&part, triangle.vertices(), &vertices.varyings);
            }
        }
        Statistics {
            primitives: primitives as u64,
            invalid: invalid as u64,
            outside: outside as u64,
            clipped: clipped as u64,
            culled: culled as u64,
            degenerate: degenerate as u64,
            fragments: self.fragments,
            samples_passed: self.samples_passed,
        }
    }

    /// Draws a triangle, or a piece of one, with the values at the caller's vertices.
    #[inline(never)]
    fn draw_part<A, R>(&mut self, part: &Part, vertices: [usize; 3], varyings: &A)
    where
        A: Attributes<Value: Varyings>,
        S: FnMut(Fragment<'_, A::Value>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let &Part { corners: [a, b, c], identity, in_fan, .. } = part;
        let bounds = sample_bounds(a, b, c);
        if !bounds.overlaps(self.area) {
            return;
        }
        let setup = part.setup();
        let (order, history) = (setup.order(), (in_fan > 0).then_some(&part.history));
        let vertices = match history {
            None => reorder(vertices, order),
            Some(_) => vertices,
        };
        let [Some(a), Some(b), Some(c)] = each(vertices, |index| varyings.fetch(index)) else { return };
        let values = match history {
            None => [a, b, c],
            Some(history) => reorder(history.interpolate(&[a, b, c], identity.provoking), order),
        };
        let pedigree = history.map(History::pedigree);
        let shading = Shading::new(&setup, &values, identity, pedigree.as_ref());
        self.draw_setup(&setup, bounds, &shading);
    }

    /// Draws a triangle that is set up.
    ///
    /// Where floats are emulated, a closure is so much code that, called in two places, it would become a function of its own, for
    /// which all that a shader may ask has to be in memory. So tiny triangles and others share one loop there. With an FPU, one
    /// is made for each: the choice for each pixel would take a seventh of its time, or more.
    #[inline(always)]
    pub(crate) fn draw_setup<V, R>(&mut self, setup: &Setup, bounds: Borders, shading: &Shading<'_, V>)
    where
        V: Varyings,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let plane = DepthPlane::new::<F::Depth>(setup, self.depth_bias, self.depth_limits);
        let is_tiny = is_tiny(setup);
        if !HAS_FPU {
            self.draw_rows(setup, bounds, shading, &plane, is_tiny);
        } else if is_tiny {
            self.draw_rows(setup, bounds, shading, &plane, true);
        } else {
            self.draw_rows(setup, bounds, shading, &plane, false);
        }
    }

    /// Draws a triangle row by row.
    ///
    /// Rows of most are solved, and their fragments start from an anchor's numbers. Of a tiny one every sample of its bounds is
    /// tested, and fragments start from their own edge functions, as in `tiny`. One of four pixels takes a tenth less on a
    /// Cortex-M4 than when its rows are solved. One of 9 to 16 pixels takes more, and is drawn like this for the sake of the
    /// same bits on every target.
    #[inline(always)]
    fn draw_rows<V, R>(
        &mut self,
        setup: &Setup,
        whole: Borders,
        shading: &Shading<'_, V>,
        plane: &DepthPlane,
        is_tiny: bool,
    ) where
        V: Varyings,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let bounds = whole.intersection(self.area);
        // What one of the two kinds needs, and the other does not.
        let (mut tiny, mut step, mut z_step, mut compact) = (TinyEdges::BLANK, WeightParts::ZERO, 0.0, None);
        if is_tiny {
            tiny = TinyEdges::new(setup, bounds.left, bounds.top);
        } else {
            (step, z_step, compact) = (shading.step_x(), plane.step_x(setup), Compact::new(setup, whole));
        }
        let plane = RowPlane::new(plane, z_step);
        // Samples looked at; those of them that are outside or fail the depth test; and those that are discarded.
        let (mut visited, mut missed, mut discarded) = (0usize, 0usize, 0usize);
        for y in bounds.top..bounds.bottom {
            let mut biased = tiny.row;
            let (mut x, end, anchor, base, z) = if is_tiny {
                tiny.row = sum(tiny.row, tiny.step_y);
                (bounds.left, bounds.right, 0, WeightParts::ZERO, 0.0)
            } else {
                let rows = match &compact {
                    Some(compact) => compact.solve(y),
                    None => solve_alone(setup, y),
                };
                let edges = [rows.edges[0][0], rows.edges[1][0], rows.edges[2][0]];
                let (base, z) = (shading.scales.parts(edges), plane.at_edges(edges[0], edges[1]));
                (rows.start[0].max(bounds.left), rows.end[0].min(bounds.right), rows.anchor[0], base, z)
            };
            let dx = |x: i32| x.wrapping_sub(anchor) as f32;
            // Depth is linear, rounding included: inside of its limits at both ends, it needs no clamp between them. A row
            // that leaves them is drawn a pixel at a time, each with a depth of its own.
            let needs_clamp = F::Depth::IS_STORED
                && !is_tiny
                && x < end
                && !(plane.contains(z, dx(x)) & plane.contains(z, dx(end - 1)));
            while x < end {
                let (z, z_step, len) =
                    if needs_clamp { (plane.moved(z, dx(x)), 0.0, 1) } else { (z, plane.step_x(), end - x) };
                let run = self.target.run(x, y, len as usize);
                // No more than was asked for, if a framebuffer lends that.
                let count = run.color.len().min(run.depth.len()).min(len as usize);
                visited += count;
                let colors = run.color.get_mut(..count).unwrap_or_default();
                let depths = run.depth.get_mut(..count).unwrap_or_default();
                let (mut at_x, mut dx) = (x, dx(x));
                for (color, depth) in colors.iter_mut().zip(depths) {
                    let mut own = [0.0; 3];
                    if is_tiny {
                        let here = biased;
                        biased = sum(biased, tiny.step_x);
                        // The sign bit of all three is clear inside.
                        if here[0] | here[1] | here[2] < 0 {
                            missed += 1;
                            at_x = at_x.wrapping_add(1);
                            continue;
                        }
                        own = tiny.at(here);
                    }
                    let z = if is_tiny {
                        plane.at_sample(own)
                    } else if F::Depth::IS_STORED {
                        z + z_step * dx
                    } else {
                        // Without a depth buffer, depth is what the closure asks for, or nothing.
                        plane.moved(z, dx)
                    };
                    let new = F::Depth::from_depth(z);
                    if F::Depth::IS_STORED && !self.test.passes(new, *depth) {
                        missed += 1;
                    } else {
                        let parts = if is_tiny { shading.scales.parts(own) } else { base.moved(step, dx) };
                        let fragment =
                            Fragment { triangle: shading, at: parts.divided(), x: at_x, y, depth: z };
                        match (self.shade)(fragment, *color).into() {
                            Some(result) => {
                                *color = result;
                                if self.test.writes() {
                                    *depth = new;
                                }
                            }
                            None => discarded += 1,
                        }
                    }
                    if !is_tiny {
                        // Whole numbers: as exact as a conversion.
                        dx += 1.0;
                    }
                    at_x = at_x.wrapping_add(1);
                }
                x += len;
            }
        }
        self.fragments += (visited - missed) as u64;
        self.samples_passed += (visited - missed - discarded) as u64;
    }
}

/// A tiny triangle's edge functions, less by one where samples on the edge are outside: those of a row's first sample, and
/// their change by a pixel right and down.
#[derive(Clone, Copy, Debug)]
struct TinyEdges {
    row: [i32; 3],
    step_x: [i32; 3],
    step_y: [i32; 3],
    bias: [i32; 3],
}

impl TinyEdges {
    const BLANK: Self = Self { row: [0; 3], step_x: [0; 3], step_y: [0; 3], bias: [0; 3] };

    #[inline(always)]
    fn new(setup: &Setup, x: i32, y: i32) -> Self {
        let [p, q, r] = each(setup.corners(), |v| [v.x() - (x << 8) - 128, v.y() - (y << 8) - 128]);
        // (a, b, E) of an edge. As in `Compact`, which sides they are is known.
        let edge = |p: [i32; 2], q: [i32; 2]| {
            let (a, b) = (p[1] - q[1], q[0] - p[0]);
            (a, b, -(a * p[0] + b * p[1]))
        };
        let (other, left, right) = (edge(q, r), edge(r, p), edge(p, q));
        let bias = [i32::from(other.0 <= 0), 0, i32::from(right.0 < 0)];
        Self {
            row: [other.2 - bias[0], left.2, right.2 - bias[2]],
            step_x: [other.0 << 8, left.0 << 8, right.0 << 8],
            step_y: [other.1 << 8, left.1 << 8, right.1 << 8],
            bias,
        }
    }

    /// The edge functions, exactly: at covered samples they are at most 2²⁴.
    #[inline(always)]
    fn at(&self, biased: [i32; 3]) -> [f32; 3] {
        each(sum(biased, self.bias), |edge| edge as f32)
    }
}

#[inline(always)]
fn sum([a, b, c]: [i32; 3], [p, q, r]: [i32; 3]) -> [i32; 3] {
    [a + p, b + q, c + r]
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::clip::DepthClip;
    use crate::depth::{CompareOp, DepthState};
    use crate::primitive::Primitives;
    use crate::rasterizer::Rasterizer;
    use crate::state::CullMode;
    use crate::target::{Rect, Surface};
    use crate::viewport::Viewport;
    use glam::Vec4;
    use std::vec::Vec;

    /// Pixels along a side of the frame.
    const SIZE: u32 = 96;

    /// Small and large triangles, many of them beyond the near and far planes or behind the eye.
    fn triangles(count: usize) -> Vec<Vec4> {
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / 16_777_216.0
        };
        let mut positions = Vec::new();
        // Slivers along rows of samples, through the near plane: of some, a piece is turned over.
        for _ in 0..count {
            let row = ((next() * SIZE as f32).floor() + 0.5) * 2.0 / SIZE as f32 - 1.0;
            for _ in 0..3 {
                let (x, y) = (next() * 2.2 - 1.1, row + (next() - 0.5) / 4096.0);
                positions.push(Vec4::new(x, y, next() * 2.0 - 1.0, 1.0) * (0.5 + next()));
            }
        }
        for i in 0..count {
            let size = [0.05, 0.3, 2.0, 400.0][i % 4];
            let (x, y, z) = (next() * 2.2 - 1.1, next() * 2.2 - 1.1, next() * 1.4 - 0.2);
            for _ in 0..3 {
                let w = if i % 7 == 0 { next() * 2.0 - 0.5 } else { 0.5 + next() };
                let (dx, dy) = (size * (next() - 0.5), size * (next() - 0.5));
                // Every other one on the grid of half pixels, where samples lie on edges.
                let place =
                    |ndc: f32| if i % 2 == 0 { (ndc * SIZE as f32).round() / SIZE as f32 } else { ndc };
                positions.push(Vec4::new(place(x + dx), place(y + dy), z + 0.3 * next(), 1.0) * w);
            }
        }
        positions
    }

    /// Everything that a fragment tells, as one colour.
    fn everything(fragment: Fragment<'_, [f32; 2]>) -> Option<[u32; 12]> {
        let ([a, b, c], [d, e, f]) = (fragment.weights(), fragment.barycentrics());
        let ([g, h], [i, _]) = (fragment.varyings(), fragment.varyings_dx());
        let is_kept = fragment.x() % 5 != 2;
        let floats = [a, b, c, d, e, f, g, h, i, fragment.depth(), fragment.inv_w()].map(f32::to_bits);
        let number = fragment.primitive_index() * 2 + u32::from(fragment.is_front_facing());
        let mut all = [number; 12];
        all[..11].copy_from_slice(&floats);
        is_kept.then_some(all)
    }

    #[test]
    fn the_same_bits_as_packets() {
        const PIXELS: usize = (SIZE * SIZE) as usize;
        let positions = triangles(600);
        let values: Vec<[f32; 2]> = positions.iter().map(|p| [p.x, p.z - p.y]).collect();
        let viewport = Viewport::of_size(SIZE, SIZE).and_then(|whole| whole.with_depth_range(-0.0, 1.0));
        let less = DepthState { compare: CompareOp::Less, write: true };
        let mut rasterizer = Rasterizer::<[f32; 2]>::new(viewport.expect("valid")).with_depth_test(less);
        rasterizer.scissor = Some(Rect { x: 3, y: 2, width: 90, height: 89 });
        for depth_clip in [DepthClip::Clip, DepthClip::Clamp] {
            for (cull_mode, compare) in [
                (CullMode::None, CompareOp::Less),
                (CullMode::Back, CompareOp::Less),
                (CullMode::None, CompareOp::Always),
            ] {
                (rasterizer.depth_clip, rasterizer.cull_mode) = (depth_clip, cull_mode);
                rasterizer.depth_test.compare = compare;
                rasterizer.depth_bias = DepthBias { constant: 2.0, slope: 0.5, clamp: 0.0 };
                let mut frames = [std::vec![[0; 12]; PIXELS], std::vec![[0; 12]; PIXELS]];
                let mut depths = [std::vec![1.0f32; PIXELS], std::vec![1.0f32; PIXELS]];
                let ([color_0, color_1], [depth_0, depth_1]) = (&mut frames, &mut depths);
                let mut target = Surface::new(color_0, depth_0, SIZE, SIZE).expect("it fits");
                let packets = rasterizer
                    .draw(&mut target, Primitives::list(), &positions[..], &values[..], everything)
                    .expect("nothing is wrong");
                let mut target = Surface::new(color_1, depth_1, SIZE, SIZE).expect("it fits");
                let list = Primitives::list();
                let alone = rasterizer
                    .draw_one_by_one(&mut target, list, &positions[..], &values[..], |f, _| everything(f))
                    .expect("nothing is wrong");
                assert_eq!(packets, alone, "statistics");
                assert!(packets.clipped > 40 && packets.samples_passed > 5000, "{packets:?}");
                let bits = |depths: &[f32]| depths.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>();
                assert!(
                    bits(&depths[0]) == bits(&depths[1]),
                    "depths, {depth_clip:?} {cull_mode:?} {compare:?}"
                );
                assert!(frames[0] == frames[1], "fragments, {depth_clip:?} {cull_mode:?} {compare:?}");
            }
        }
    }
}
