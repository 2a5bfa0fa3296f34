//! Small triangles that are hidden: all depths around them are nearer.
//!
//! Of a scene with much behind other things, more than half of the triangles may be hidden when they come, most often one
//! after the other. So where the last triangle was hidden, the next one's nearest corner is compared with the depths in its
//! bounds, before anything else of it is worked out: a load and a comparison for four pixels, instead of edge functions, depth
//! and coverage. The picture is the same as without it, to the bit.

#![expect(clippy::cast_possible_truncation, reason = "windows are up to 16 pixels wide")]
#![expect(clippy::cast_possible_wrap, reason = "windows are up to 16 pixels wide")]

use glam::Vec4;

use crate::depth::{DepthTest, passes};
use crate::plane::DepthPlane;
use crate::setup::Setup;
use crate::target::{Borders, Framebuffer, lend};

/// The largest extent of a triangle that is looked at, in pixels. Of larger ones, more and more of the bounds is not theirs.
const SIDE: u32 = 32;

/// True only if no sample of a triangle can pass. If `is_less`, the test passes smaller depths, or else larger ones.
#[inline(always)]
pub(crate) fn is_behind<F: Framebuffer>(
    target: &mut F,
    (target_area, render_area): (Borders, Borders),
    (test, is_less): (impl DepthTest, bool),
    setup: &Setup,
    plane: &DepthPlane,
) -> bool {
    if setup.extent() > SIDE << 8 {
        return false;
    }
    let (bounds, nearest) = (setup.borders(), plane.nearest(setup, is_less));
    let rows = bounds.intersection(render_area);
    let rows = (rows.top, rows.bottom);
    match bounds.right - bounds.left {
        ..=4 => hide::<_, 4>(target, target_area, (bounds.left, rows), test, nearest),
        5..=8 => hide::<_, 8>(target, target_area, (bounds.left, rows), test, nearest),
        9..=12 => hide::<_, 12>(target, target_area, (bounds.left, rows), test, nearest),
        13..=16 => hide::<_, 16>(target, target_area, (bounds.left, rows), test, nearest),
        _ => {
            hide::<_, 16>(target, target_area, (bounds.left, rows), test, nearest)
                && hide::<_, 16>(target, target_area, (bounds.right - 16, rows), test, nearest)
        }
    }
}

/// Whether rows `top .. bottom` hide a depth in `N` columns, from `left` on or, if the framebuffer ends too early on the right, as
/// many columns before. Where it lends no block, or is less wide, nobody knows.
#[inline(always)]
fn hide<F: Framebuffer, const N: usize>(
    target: &mut F,
    area: Borders,
    (left, (top, bottom)): (i32, (i32, i32)),
    test: impl DepthTest,
    nearest: f32,
) -> bool {
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
                passing[i] |= if passes(test, nearest, depths[4 * quarter + i]) { u32::MAX } else { 0 };
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
    use crate::coarse::direction;
    use crate::depth::{
        Always, CompareOp, DepthBias, DepthFormat, Equal, Greater, GreaterOrEqual, Less, LessOrEqual,
    };
    use crate::primitive::Primitives;
    use crate::project::ProjectedVertex;
    use crate::rasterizer::Rasterizer;
    use crate::target::{Absent, Rect, Surface};
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
                let bias =
                    DepthBias { constant: 0.0, slope: if next() < 0.5 { 0.0 } else { -0.5 }, clamp: 0.0 };
                let plane = DepthPlane::new::<f32>(&setup, bias.unless_zero(), (0.0, 1.0));
                let (low, high) = (plane.nearest(&setup, true), plane.nearest(&setup, false));
                let area = Rect { x: -12, y: -12, width: 64, height: 64 };
                depths.fill(-1.0);
                let mut target =
                    Surface::with_planes(Absent::default(), &mut depths[..], area, 64).expect("it fits");
                let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(40, 40).expect("valid"));
                rasterizer.depth_bias = bias;
                let corners = setup.corners();
                let rasterizer = rasterizer.with_depth_test(Always);
                let positions = [glam::Vec4::W; 3];
                let projected = crate::project::Projected::new(&corners, &positions).expect("as many");
                rasterizer.draw(&mut target, Primitives::list(), projected, (), |_| ()).expect("no index");
                for &z in depths.iter().filter(|&&z| z >= 0.0) {
                    assert!(low <= z && z <= high, "{low} {z} {high} of {setup:?}");
                    if scale == 1.0 {
                        tightest = tightest.min(z - low).min(high - z);
                    }
                }
            }
        }
        assert!(tightest < 1e-5, "and hardly farther: {tightest}");
    }

    #[test]
    fn whatever_can_be_seen_is_not_behind() {
        let mut next = random(9);
        let frames = [
            Rect { x: -20, y: -20, width: 90, height: 90 },
            Rect { x: 3, y: 2, width: 5, height: 40 },
            Rect { x: 10, y: 10, width: 19, height: 1 },
        ];
        for size in [3.0, 4.0, 8.0, 12.0, 16.0, 32.0, 33.0] {
            for _ in 0..60 {
                let setup = triangle(&mut next, size, 1.0);
                let plane = DepthPlane::new::<f32>(&setup, None, (0.0, 1.0));
                let edges = setup.edges();
                for area in frames {
                    let mut depths = std::vec![-1.0f32; area.width as usize * area.height as usize];
                    let scissor = area.intersection(Rect { x: 0, y: 0, width: 40, height: 30 });
                    let areas = (area.borders(), scissor.borders());
                    let is_behind = |depths: &mut [f32]| {
                        let stride = area.width as usize;
                        let mut target =
                            Surface::with_planes(Absent::default(), depths, area, stride).expect("it fits");
                        super::is_behind(&mut target, areas, (Less, true), &setup, &plane)
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
            }
        }
    }

    #[test]
    fn the_picture_is_the_same_where_nothing_is_left_out() {
        compare::<f32>(Less, 1.0, 0.0);
        compare::<f32>(LessOrEqual, 1.0, 2.0);
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
        target.1
    }

    #[test]
    fn after_a_hidden_triangle_hidden_ones_are_left_out() {
        if crate::traverse::HAS_FLOAT_LANES {
            assert_eq!(runs(Less, 10), runs(Less, 1), "only the first is traversed");
            assert!(runs(Unsaid(Less), 10) > runs(Less, 1), "all are");
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
