//! Small triangles that are hidden: all depths around them are nearer.
//!
//! Of a scene with much behind other things, more than half of the triangles may be hidden when they come, most often one
//! after the other. So of each batch, before anything of it is set up, the first one's nearest corner is compared with the depths
//! in its bounds: a load and a comparison for four pixels, instead of edge functions, depth and coverage. As long as such looks
//! find something, the next one is looked at, too. The picture is the same as without it, to the bit.

#![expect(clippy::cast_possible_truncation, reason = "windows are up to 16 pixels wide")]
#![expect(clippy::cast_possible_wrap, reason = "windows are up to 16 pixels wide")]

use glam::Vec4;

use crate::coarse::direction;
use crate::depth::{DepthBias, DepthFormat, DepthTest, passes};
use crate::plane::nearest;
use crate::project::ProjectedVertex;
use crate::queue::Queue;
use crate::target::{Borders, Framebuffer, lend};
use crate::triple::each;

/// The largest extent of a triangle that is looked at, in samples. Of larger ones, more and more of the bounds is not theirs.
const SIDE: i32 = 32;

/// After so many looks in a row that were in vain, no more of a batch are looked at. Then each further batch gets one look, until
/// one finds something.
const IN_VAIN: u32 = 3;

/// What a look at a triangle tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sight {
    /// No sample of it can pass.
    Behind,
    /// Perhaps some can.
    Unknown,
    /// Nobody looked, nor should at those that come after it.
    Enough,
}

/// Leaves out those that are behind, and looks at one after the other until it is enough.
///
/// Where draws are dispatched, the closures are told to be inlined: each is used in several functions then, and LLVM would call it,
/// compiled for the least processor of all.
#[inline(always)]
pub(crate) fn keep_seen(queue: &mut Queue, mut look: impl FnMut(usize) -> Sight) {
    let mut to_look_at = *queue;
    while let Some(number) = to_look_at.pop() {
        match look(number) {
            Sight::Behind => queue.remove(number),
            Sight::Unknown => {}
            Sight::Enough => return,
        }
    }
}

/// A look at the depths around triangles that are about to be drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glance<T> {
    /// What the framebuffer has, and which of it may be drawn to.
    target_area: Borders,
    render_area: Borders,
    test: T,
    depth_limits: (f32, f32),
    /// Whether nearer is less.
    is_less: bool,
    /// How many looks in a row were in vain.
    in_vain: u32,
}

impl<T: DepthTest> Glance<T> {
    /// None if nothing is known of what the test compares, or if the bias may bring triangles nearer.
    pub(crate) fn new(
        (target_area, render_area): (Borders, Borders),
        test: T,
        bias: Option<DepthBias>,
        depth_limits: (f32, f32),
    ) -> Option<Self> {
        let is_less = direction(test)?;
        let is_away = |DepthBias { constant, slope, .. }| {
            let sign = if is_less { 1.0 } else { -1.0 };
            (0.0..=f32::MAX).contains(&(constant * sign)) & (0.0..=f32::MAX).contains(&(slope * sign))
        };
        bias.is_none_or(is_away).then_some(Self {
            target_area,
            render_area,
            test,
            depth_limits,
            is_less,
            in_vain: 0,
        })
    }

    /// Before the first look at a batch, which is worth it in any case.
    #[inline(always)]
    pub(crate) fn begin(&mut self) {
        self.in_vain = self.in_vain.min(IN_VAIN - 1);
    }

    /// Looks at the triangle with these corners and bounds.
    #[inline(always)]
    pub(crate) fn look<F: Framebuffer>(
        &mut self,
        target: &mut F,
        corners: [ProjectedVertex; 3],
        bounds: Borders,
    ) -> Sight {
        if self.in_vain >= IN_VAIN || !F::Depth::IS_STORED {
            return Sight::Enough;
        }
        let is_small = (bounds.right - bounds.left).max(bounds.bottom - bounds.top) <= SIDE;
        let z = nearest(each(corners, |corner| corner.depth()), self.is_less, self.depth_limits);
        if is_small && self.all_are_nearer(target, bounds, z) {
            self.in_vain = 0;
            Sight::Behind
        } else {
            self.in_vain += 1;
            Sight::Unknown
        }
    }

    /// Whether all depths in these bounds, up to 32 pixels wide, are nearer than this one, as far as a look can tell.
    #[inline(always)]
    fn all_are_nearer<F: Framebuffer>(&self, target: &mut F, bounds: Borders, z: f32) -> bool {
        let rows = bounds.intersection(self.render_area);
        let (area, test, rows) = (self.target_area, self.test, (rows.top, rows.bottom));
        match bounds.right - bounds.left {
            ..=4 => is_window_nearer::<_, 4>(target, area, (bounds.left, rows), test, z),
            5..=8 => is_window_nearer::<_, 8>(target, area, (bounds.left, rows), test, z),
            9..=12 => is_window_nearer::<_, 12>(target, area, (bounds.left, rows), test, z),
            13..=16 => is_window_nearer::<_, 16>(target, area, (bounds.left, rows), test, z),
            _ => {
                is_window_nearer::<_, 16>(target, area, (bounds.left, rows), test, z)
                    && is_window_nearer::<_, 16>(target, area, (bounds.right - 16, rows), test, z)
            }
        }
    }
}

/// Whether a fragment at `z` fails against all depths of rows `top .. bottom` in `N` columns, from `left` on or, if the framebuffer
/// ends too early on the right, as many columns before. Where it lends no block, or is less wide, nobody knows.
#[inline(always)]
fn is_window_nearer<F: Framebuffer, const N: usize>(
    target: &mut F,
    area: Borders,
    (left, (top, bottom)): (i32, (i32, i32)),
    test: impl DepthTest,
    z: f32,
) -> bool {
    // Never so, but of positions that are others when they are asked for again.
    if top >= bottom {
        return true;
    }
    let x = left.min(area.right.wrapping_sub(N as i32)).max(area.left);
    let (width, height) = ((N as i32).min(area.right - x) as usize, (bottom - top) as usize);
    let Some(block) = lend(target, (x, top), (width, height)) else { return false };
    let mut at = 0usize;
    for _ in 0..height {
        let Some(depths) = block.depth.get(at..at.wrapping_add(N)).and_then(<[_]>::first_chunk::<N>) else {
            return false;
        };
        let mut passing = [0u32; 4];
        for quarter in 0..N / 4 {
            for i in 0..4 {
                passing[i] |= if passes(test, z, depths[4 * quarter + i]) { u32::MAX } else { 0 };
            }
        }
        if Vec4::from_array(passing.map(f32::from_bits)).is_negative_bitmask() != 0 {
            return false;
        }
        at = at.wrapping_add(block.stride);
    }
    true
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::depth::{Always, CompareOp, DepthState, Equal, Greater, GreaterOrEqual, Less, LessOrEqual};
    use crate::primitive::Primitives;
    use crate::rasterizer::Rasterizer;
    use crate::setup::{Setup, sample_bounds};
    use crate::target::{Absent, Rect, Surface};
    use crate::traverse::HAS_FLOAT_LANES;
    use crate::viewport::Viewport;
    use std::vec::Vec;

    /// A test that does not say what it compares: nothing is left out early.
    #[derive(Clone, Copy)]
    struct Unsaid<T>(T);

    impl<T: DepthTest> DepthTest for Unsaid<T> {
        fn passes<D: PartialOrd>(self, new: D, old: D) -> bool {
            self.0.passes(new, old)
        }
    }

    /// Random numbers from 0 to 1.
    fn random(mut state: u32) -> impl FnMut() -> f32 {
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        }
    }

    /// A triangle up to `size` pixels large, or a sliver, anywhere around (0, 0) .. (40, 40); its corners often on samples, and
    /// often on the border of a square of that size. Depths from 0 to `scale`.
    fn triangle(next: &mut impl FnMut() -> f32, size: f32, scale: f32) -> Setup {
        loop {
            let (x, y) = ((next() * 60.0).floor() - 10.0, (next() * 60.0).floor() - 10.0);
            let (width, height) = if next() < 0.2 { (size, 0.1) } else { (size, size) };
            let (z, slope) = (next(), if next() < 0.5 { 1e-3 } else { 1.0 });
            let is_on_samples = next() < 0.5;
            let mut vertex = || {
                let mut along = |size: f32| {
                    let at = if next() < 0.5 { (next() * 2.0).floor() } else { next() } * size;
                    if is_on_samples { at.round() + 0.5 } else { at }
                };
                let position = [x + along(width), y + along(height)];
                let [x, y] = position.map(|at| (at * 256.0) as i32);
                let z = (z + (next() - 0.5) * slope).clamp(0.0, 1.0) * scale;
                ProjectedVertex::new(x, y, z, 0.5 + next()).expect("in range")
            };
            if let Some(setup) = Setup::new([vertex(), vertex(), vertex()]) {
                return setup;
            }
        }
    }

    #[test]
    fn no_sample_is_nearer_than_the_nearest() {
        let (mut next, mut tightest) = (random(5), 1.0f32);
        let mut depths = [0.0f32; 64 * 64];
        for size in [3.0, 8.0, 16.0, 32.0] {
            for _ in 0..600 {
                let scale = if next() < 0.5 { 1.0 } else { f32::MIN_POSITIVE * (1 << 18) as f32 * next() };
                let setup = triangle(&mut next, size, scale);
                let corners = setup.corners();
                let of_corners = each(corners, |corner| corner.depth());
                let (low, high) =
                    (nearest(of_corners, true, (0.0, 1.0)), nearest(of_corners, false, (0.0, 1.0)));
                let area = Rect { x: -12, y: -12, width: 64, height: 64 };
                let slope = [0.0, 0.5, -0.5][(next() * 3.0) as usize];
                depths.fill(-1.0);
                let mut target =
                    Surface::with_planes(Absent::default(), &mut depths[..], area, 64).expect("it fits");
                let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(40, 40).expect("valid"));
                rasterizer.depth_bias = DepthBias { constant: 0.0, slope, clamp: 0.0 };
                let rasterizer = rasterizer.with_depth_test(Always);
                let positions = [glam::Vec4::W; 3];
                let projected = crate::project::Projected::new(&corners, &positions).expect("as many");
                rasterizer.draw(&mut target, Primitives::list(), projected, (), |_| ()).expect("no index");
                for &z in depths.iter().filter(|&&z| z >= 0.0) {
                    assert!(low <= z || slope < 0.0, "{low} {z} of {setup:?}");
                    assert!(z <= high || slope > 0.0, "{z} {high} of {setup:?}");
                    if scale == 1.0 && slope == 0.0 {
                        tightest = tightest.min(z - low).min(high - z);
                    }
                }
            }
        }
        assert!(tightest < 2e-5, "and hardly farther: {tightest}");
    }

    #[test]
    fn nothing_is_left_out_that_a_bias_may_bring_nearer() {
        let areas = [Rect::of_size(9, 9).borders(); 2];
        let looks = |test, constant, slope| {
            let bias = DepthBias { constant, slope, clamp: 0.0 }.unless_zero();
            Glance::new((areas[0], areas[1]), test, bias, (0.0, 1.0)).is_some()
        };
        let (less, greater) = (CompareOp::Less, CompareOp::Greater);
        let test = |compare| DepthState { compare, write: true };
        assert!(looks(test(less), 0.0, 0.0) && looks(test(greater), 0.0, 0.0), "without");
        assert!(looks(test(less), 2.0, 1.5) && looks(test(greater), -2.0, -1.5), "away");
        assert!(looks(test(less), -0.0, 1.0), "the sign of a zero is nothing");
        for (constant, slope) in [(-1.0, 0.0), (1.0, -1.0), (f32::NAN, 0.0), (0.0, f32::INFINITY)] {
            assert!(!looks(test(less), constant, slope), "{constant} {slope}");
            assert!(!looks(test(greater), -constant, -slope), "the other way {constant} {slope}");
        }
        assert!(!looks(test(less), f32::INFINITY, 0.0) && !looks(test(CompareOp::Equal), 0.0, 0.0));
    }

    #[test]
    fn whatever_can_be_seen_is_not_behind() {
        let mut next = random(9);
        let frames = [
            Rect { x: -20, y: -20, width: 90, height: 90 },
            Rect { x: 3, y: 2, width: 5, height: 40 },
            Rect { x: 10, y: 10, width: 19, height: 1 },
        ];
        for size in [1.5, 3.0, 4.0, 8.0, 12.0, 16.0, 32.0, 33.0] {
            for _ in 0..60 {
                let setup = triangle(&mut next, size, 1.0);
                let edges = setup.edges();
                for area in frames {
                    let mut depths = std::vec![-1.0f32; area.width as usize * area.height as usize];
                    let scissor = area.intersection(Rect { x: 0, y: 0, width: 40, height: 30 });
                    let areas = (area.borders(), scissor.borders());
                    let is_behind = |depths: &mut [f32]| {
                        let stride = area.width as usize;
                        let mut target =
                            Surface::with_planes(Absent::default(), depths, area, stride).expect("it fits");
                        let mut glance =
                            Glance::new(areas, Less, None, (0.0, 1.0)).expect("it has a direction");
                        glance.look(&mut target, setup.corners(), setup.borders()) == Sight::Behind
                    };
                    // A framebuffer narrower than a window cannot tell, and larger triangles are not looked at.
                    assert!(
                        is_behind(&mut depths) || area.width < 16 || size > 32.0,
                        "all is nearer: {setup:?} in {area:?}"
                    );
                    for y in scissor.y..scissor.bottom() {
                        for x in scissor.x..scissor.right() {
                            if edges.iter().all(|edge| edge.covers(x, y)) {
                                let at = (y - area.y) as usize * area.width as usize + (x - area.x) as usize;
                                depths[at] = 2.0;
                                assert!(!is_behind(&mut depths), "{x} {y} of {setup:?} in {area:?}");
                                depths[at] = -1.0;
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_behind_is_left_out_until_it_is_enough() {
        if !HAS_FLOAT_LANES {
            return; // A queue holds one triangle at most.
        }
        let keep = |behind: &[usize], enough: usize, len: usize| {
            let mut queue = Queue::below(len);
            keep_seen(&mut queue, |i| match i {
                i if i >= enough => Sight::Enough,
                i if behind.contains(&i) => Sight::Behind,
                _ => Sight::Unknown,
            });
            core::iter::from_fn(|| queue.pop()).collect::<Vec<_>>()
        };
        assert_eq!(keep(&[0, 2, 3], 9, 6), [1, 4, 5], "in the middle");
        assert_eq!(keep(&[0, 2, 3, 5], 3, 6), [1, 3, 4, 5], "the rest is not looked at");
        assert_eq!(keep(&[], 9, 6), [0, 1, 2, 3, 4, 5], "none");
        assert_eq!(keep(&[0, 1], 0, 3), [0, 1, 2], "no look at all");
        assert!(keep(&[0, 1, 2, 3, 4, 5, 6, 7, 8], 9, 9).is_empty(), "all");
        assert!(keep(&[], 9, 0).is_empty(), "of none");
    }

    #[test]
    fn looks_end_where_they_are_in_vain() {
        let area = Rect::of_size(40, 40);
        let mut depths = [0.0; 40 * 40];
        depths[20 * 40..].fill(1.0);
        let mut target = Surface::depth_only(&mut depths, 40, 40).expect("it fits");
        let mut glance =
            Glance::new((area.borders(), area.borders()), Less, None, (0.0, 1.0)).expect("so it is");
        let mut look = |glance: &mut Glance<Less>, x: i32, y: i32| {
            let vertex = |x, y| ProjectedVertex::new(x * 256, y * 256, 0.5, 1.0).expect("in range");
            let corners @ [a, b, c] = [vertex(x, y), vertex(x, y + 5), vertex(x + 5, y)];
            glance.look(&mut target, corners, sample_bounds(a, b, c))
        };
        glance.begin();
        let (hidden, seen) = ((3, 3), (3, 25));
        let mut looks = |glance: &mut Glance<Less>, at: &[(i32, i32)]| {
            at.iter().map(|&(x, y)| look(glance, x, y)).collect::<Vec<_>>()
        };
        let (yes, no) = (Sight::Behind, Sight::Unknown);
        assert_eq!(
            looks(&mut glance, &[hidden, seen, hidden, seen]),
            [yes, no, yes, no],
            "as long as it pays"
        );
        assert_eq!(
            looks(&mut glance, &[seen, seen, hidden, hidden]),
            [no, no, Sight::Enough, Sight::Enough],
            "no longer"
        );
        glance.begin();
        assert_eq!(looks(&mut glance, &[seen, hidden]), [no, Sight::Enough], "one in the next batch");
        glance.begin();
        assert_eq!(
            looks(&mut glance, &[hidden, seen, hidden]),
            [yes, no, yes],
            "and more again if that pays"
        );
    }

    /// Draws many small triangles over each other. What they leave is the same whether hidden ones are left out early or not.
    fn compare<D: DepthFormat + core::fmt::Debug>(test: impl DepthTest, far: f32, bias: f32) {
        let mut next = random(3);
        let positions: Vec<_> = (0..3000)
            .flat_map(|i| {
                let size = [0.1, 0.3, 0.6, 1.2, 0.05][i / 50 % 5];
                let (x, y, z) = (next() * 2.2 - 1.1, next() * 2.2 - 1.1, next() * 0.9);
                let w = 0.5 + next();
                [(); 3].map(|()| {
                    let (x, y) = (x + size * (next() - 0.5), y + size * (next() - 0.5));
                    Vec4::new(x, y, z + 0.1 * next(), 1.0) * w
                })
            })
            .collect();
        for (width, height) in [(61, 47), (5, 90)] {
            let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(width, height).expect("valid"));
            rasterizer.depth_bias = DepthBias { constant: bias, slope: bias, clamp: 0.0 };
            for scissor in [None, Some(Rect { x: 2, y: 3, width: 37, height: 29 })] {
                rasterizer.scissor = scissor;
                let pixels = (width * height) as usize;
                let (mut color, mut depth) = (std::vec![0; pixels], std::vec![D::from_depth(far); pixels]);
                let mut target = Surface::new(&mut color, &mut depth, width, height).expect("it fits");
                let looks = rasterizer.with_depth_test(test);
                let number = |fragment: crate::Fragment<'_, ()>| fragment.primitive_index();
                let drawn = looks.draw(&mut target, Primitives::list(), &positions[..], (), number);
                let (mut other, mut other_depth) =
                    (std::vec![0; pixels], std::vec![D::from_depth(far); pixels]);
                let mut target = Surface::new(&mut other, &mut other_depth, width, height).expect("it fits");
                let does_not = rasterizer.with_depth_test(Unsaid(test));
                let expected = does_not.draw(&mut target, Primitives::list(), &positions[..], (), number);
                assert_eq!(drawn, expected, "statistics");
                assert!(color == other && depth == other_depth, "the picture");

                depth.fill(D::from_depth(far));
                let mut target = Surface::depth_only(&mut depth, width, height).expect("it fits");
                let drawn = looks.draw_depth(&mut target, Primitives::list(), &positions[..]);
                assert_eq!(drawn, expected, "statistics of depths alone");
                assert!(depth == other_depth, "depths alone");

                color.fill(0);
                depth.fill(D::from_depth(far));
                let mut target = Surface::new(&mut color, &mut depth, width, height).expect("it fits");
                let mut records = std::vec![crate::Record::default(); 3000];
                let mut preparation = looks
                    .prepare(target.area(), Primitives::list(), &positions[..], ())
                    .expect("no index is out of range");
                let records = preparation.fill(&mut records).expect("there is room").expect("there are some");
                let drawn = looks.draw_prepared(&mut target, records, number);
                assert_eq!(Ok(drawn.fragments), expected.map(|all| all.fragments), "statistics of records");
                assert!(color == other && depth == other_depth, "of records");
            }
        }
    }

    #[test]
    fn the_picture_is_the_same_where_nothing_is_left_out() {
        compare::<f32>(Less, 1.0, 0.0);
        compare::<f32>(LessOrEqual, 1.0, 2.0);
        compare::<f32>(Less, 1.0, -2.0);
        compare::<u16>(LessOrEqual, 1.0, 0.0);
        compare::<f32>(Greater, 0.0, -0.25);
        compare::<u16>(GreaterOrEqual, 0.0, 0.0);
    }

    /// Counts the runs that a draw asks for.
    struct Counting<'a>(Surface<&'a mut [u32], &'a mut [f32]>, usize);

    impl Framebuffer for Counting<'_> {
        type Color = u32;
        type Depth = f32;

        fn area(&self) -> Rect {
            self.0.area()
        }

        fn run(&mut self, x: i32, y: i32, len: usize) -> crate::Run<'_, u32, f32> {
            self.1 += 1;
            self.0.run(x, y, len)
        }

        fn block(
            &mut self,
            x: i32,
            y: i32,
            width: usize,
            height: usize,
        ) -> Option<crate::Block<'_, u32, f32>> {
            self.0.block(x, y, width, height)
        }
    }

    /// How many runs some hidden triangles of 20 pixels take.
    fn runs(test: impl DepthTest, triangles: usize) -> usize {
        let (mut color, mut depth) = ([0; 64 * 64], [0.25; 64 * 64]);
        let surface = Surface::new(&mut color, &mut depth, 64, 64).expect("it fits");
        let mut target = Counting(surface, 0);
        let rasterizer =
            Rasterizer::<()>::new(Viewport::of_size(64, 64).expect("valid")).with_depth_test(test);
        let triangle = [(0.0, 0.0), (0.6, 0.0), (0.0, 0.6)].map(|(x, y)| Vec4::new(x, y, 0.5, 1.0));
        let positions = triangle.repeat(triangles);
        let drawn = rasterizer.draw(&mut target, Primitives::list(), &positions[..], (), |_| 1);
        assert_eq!(drawn.map(|drawn| drawn.fragments), Ok(0), "all are hidden");
        let drawn = rasterizer.draw_depth(&mut target, Primitives::list(), &positions[..]);
        assert_eq!(drawn.map(|drawn| drawn.fragments), Ok(0), "all are hidden");
        target.1
    }

    #[test]
    fn hidden_triangles_are_left_out() {
        if HAS_FLOAT_LANES {
            assert_eq!(runs(Less, 200), runs(Less, 0), "none is traversed");
            assert!(runs(Unsaid(Less), 10) > runs(Less, 0) + 100, "all are");
        }
    }

    #[test]
    fn tests_without_a_direction_hide_nothing() {
        assert_eq!((direction(Less), direction(GreaterOrEqual)), (Some(true), Some(false)), "both ways");
        assert_eq!(
            (direction(Equal), direction(Always), direction(Unsaid(Less))),
            (None, None, None),
            "neither"
        );
        assert_eq!(Unsaid(Less).compare(), None::<CompareOp>, "nothing said");
    }
}
