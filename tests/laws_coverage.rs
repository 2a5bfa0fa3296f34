//! Laws of coverage: every sample once, whatever the mesh.
//!
//! Vertices come from the half-pixel grid, where edges run through samples, from the subpixel grid, and from anywhere.

mod common;

use common::{Frame, Random, config, projected};
use glam::Vec4;
use halfplane::{Coverage, CullMode, Primitives, Rasterizer, Rect, Setup};
use proptest::prelude::*;

const FRAME: Frame = Frame::new(32, 32);

/// Where vertices lie.
#[derive(Clone, Copy, Debug)]
enum Grid {
    HalfPixels,
    Subpixels,
    None,
}

impl Grid {
    fn snap(self, x: f32) -> f32 {
        match self {
            Self::HalfPixels => (x * 2.0).round() / 2.0,
            Self::Subpixels => (x * 256.0).round() / 256.0,
            Self::None => x,
        }
    }
}

fn grid() -> impl Strategy<Value = Grid> {
    prop_oneof![Just(Grid::HalfPixels), Just(Grid::Subpixels), Just(Grid::None)]
}

/// A point at most `reach` pixels outside of the frame.
fn point(reach: f32) -> impl Strategy<Value = [f32; 2]> {
    let range = -reach..32.0 + reach;
    [range.clone(), range]
}

fn points(reach: f32, count: core::ops::Range<usize>) -> impl Strategy<Value = Vec<[f32; 2]>> {
    (grid(), prop::collection::vec(point(reach), count))
        .prop_map(|(grid, points)| points.into_iter().map(|point| point.map(|x| grid.snap(x))).collect())
}

/// Positions with a w each; the place on the screen stays.
fn place(points: &[[f32; 2]], random: &mut Random) -> Vec<Vec4> {
    points
        .iter()
        .map(|&[x, y]| FRAME.place(x, y, 0.5, random.choose(&[0.25, 1.0, 1.0, 2.0, 3.0, 17.0])))
        .collect()
}

/// The triangles of a fan around a point, as a list.
fn fan_around(centre: Vec4, rim: &[Vec4]) -> Vec<Vec4> {
    rim.iter().zip(rim.iter().cycle().skip(1)).flat_map(|(&a, &b)| [centre, a, b]).collect()
}

proptest! {
    #![proptest_config(config(60))]

    /// Fronts less backs are how often the outline winds around a sample, wherever the centre of the fan lies: what a
    /// triangle covers too much, its neighbours cover too little.
    #[test]
    fn a_fan_of_any_polygon_has_the_same_signed_coverage(
        rim in points(8.0, 3..9), centres in points(40.0, 2..3), seed in any::<u64>(),
    ) {
        let random = &mut Random::new(seed);
        let (rim, centres) = (place(&rim, random), place(&centres, random));
        let one = FRAME.signed_counts(&fan_around(centres[0], &rim));
        let other = FRAME.signed_counts(&fan_around(centres[1], &rim));
        prop_assert_eq!(one, other, "the outline alone decides");
    }

    /// As many fronts as backs are seen through a closed surface, at every sample.
    #[test]
    fn closed_surfaces_show_as_many_fronts_as_backs(corners in points(20.0, 4..5), seed in any::<u64>()) {
        let corners = place(&corners, &mut Random::new(seed));
        let tetrahedron = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]].as_flattened();
        let positions: Vec<Vec4> = tetrahedron.iter().map(|&i: &usize| corners[i]).collect();
        prop_assert!(FRAME.signed_counts(&positions).iter().all(|&count| count == 0), "{:?}", corners);
    }

    /// A convex polygon around its centre: once inside, never outside, and the outline as the fan from a corner has it.
    #[test]
    fn every_sample_of_a_convex_polygon_is_drawn_once(
        radius in 3.0f32..40.0, corners in 3usize..24, grid in grid(), seed in any::<u64>(),
    ) {
        let random = &mut Random::new(seed);
        let middle = [0, 1].map(|_| grid.snap(random.range(12.0, 20.0)));
        let rim: Vec<_> = (0..corners)
            .map(|i| {
                let angle = (i as f32 + random.range(0.0, 0.7)) / corners as f32 * core::f32::consts::TAU;
                [middle[0] + radius * angle.cos(), middle[1] - radius * angle.sin()].map(|x| grid.snap(x))
            })
            .collect();
        let turns = |i: usize| {
            let [a, b] = [rim[i], rim[(i + 1) % corners]].map(|p| [p[0] - middle[0], p[1] - middle[1]]);
            a[0] * b[1] - a[1] * b[0]
        };
        // Snapping may move a corner past its neighbour, or put the middle outside of a narrow triangle.
        prop_assume!((0..corners).all(|i| turns(i) < -0.1), "turns one way around the middle");
        let positions = fan_around(place(&[middle], random)[0], &place(&rim, random));
        let counts = FRAME.counts(&positions);
        prop_assert!(counts.iter().all(|&count| count <= 1), "doubles: {:?}", counts);
        let inside = |x: f32, y: f32| (0..corners).all(|i| {
            let (a, b) = (rim[i], rim[(i + 1) % corners]);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            // A pixel inside of every edge. (The polygon may have lost its convexity to the grid, but not by a pixel.)
            dx * (y - a[1]) - dy * (x - a[0]) < -dx.hypot(dy)
        });
        let complaint = FRAME.complaint(&counts, |x, y, count| {
            count == 1 || !inside(x as f32 + 0.5, y as f32 + 0.5)
        });
        prop_assert!(complaint.is_none(), "holes: {complaint:?}");
    }

    /// A jittered grid that is larger than the frame: every sample once, in any order and with any diagonals.
    #[test]
    fn every_sample_under_a_mesh_is_drawn_once(cells in 1i32..12, grid in grid(), seed in any::<u64>()) {
        let random = &mut Random::new(seed);
        let size = 40.0 / cells as f32;
        let jitter = if size > 3.0 { 0.2 * size } else { 0.0 };
        let points: Vec<_> = (0..=cells)
            .flat_map(|j| (0..=cells).map(move |i| [i, j]))
            .map(|at| at.map(|i| grid.snap(i as f32 * size - 4.0 + random.range(-jitter, jitter).clamp(-3.0, 3.0))))
            .collect();
        let vertices = place(&points, random);
        let vertex = |i: i32, j: i32| vertices[usize::try_from(j * (cells + 1) + i).expect("not negative")];
        let mut triangles = Vec::new();
        for (i, j) in (0..cells).flat_map(|j| (0..cells).map(move |i| (i, j))) {
            let [a, b, c, d] = [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)];
            let (one, other) = random.choose(&[([a, b, c], [a, c, d]), ([b, c, d], [b, d, a])]);
            triangles.extend([one, other]);
        }
        random.shuffle(&mut triangles);
        let counts = FRAME.counts(triangles.as_flattened());
        let complaint = FRAME.complaint(&counts, |_, _, count| count == 1);
        prop_assert!(complaint.is_none(), "not once: {complaint:?}");
    }

    /// Slivers whose outer ends lie thousands to millions of pixels away: cut at the guard band or not, every sample
    /// once.
    #[test]
    fn every_sample_under_a_fan_of_slivers_is_drawn_once(
        reach in prop::sample::select(vec![1e3f32, 1e4, 1.6e4, 1.7e4, 3e4, 1e5, 1e6]),
        count in 50i32..300, grid in grid(), seed in any::<u64>(),
    ) {
        let random = &mut Random::new(seed);
        let middle = [0, 1].map(|_| grid.snap(random.range(4.0, 28.0)));
        let rim: Vec<_> = (0..count)
            .map(|i| {
                let angle = (i as f32 + random.range(0.0, 0.9)) / count as f32 * core::f32::consts::TAU;
                [16.0 + reach * angle.cos(), 16.0 + reach * angle.sin()].map(|x| grid.snap(x))
            })
            .collect();
        let positions = fan_around(place(&[middle], random)[0], &place(&rim, random));
        let counts = FRAME.counts(&positions);
        let complaint = FRAME.complaint(&counts, |_, _, count| count == 1);
        prop_assert!(complaint.is_none(), "not once, {count} slivers of {reach} px: {complaint:?}");
    }

    /// A mirrored triangle covers the mirrored samples, but for samples on its edges, which the fill rule gives to the
    /// other side.
    #[test]
    fn mirroring_the_triangle_mirrors_its_samples(corners in points(8.0, 3..4)) {
        let corners = [corners[0], corners[1], corners[2]];
        let rasterizer = Rasterizer::<()>::new(FRAME.viewport());
        let vertices = projected(&rasterizer, corners.map(|corner| FRAME.at(corner)));
        // What is mirrored are the corners on the grid: rounding has ties of its own.
        let corners = vertices.map(|v| v.position_subpixel().expect("near").map(|x| x as f32 / 256.0));
        let Some(setup) = Setup::new(vertices) else { return Ok(()) };
        let on_an_edge = |x: i32, y: i32| setup.edges().iter().any(|edge| edge.at(x, y) == 0);
        let counts = |turn: fn([f32; 2]) -> [f32; 2]| FRAME.counts(&corners.map(turn).map(|p| FRAME.at(p)));
        let plain = counts(|p| p);
        let at = |counts: &[u8], x: i32, y: i32| counts[usize::try_from(y * 32 + x).expect("inside")];
        let mirrored = counts(|[x, y]| [32.0 - x, y]);
        let flipped = counts(|[x, y]| [x, 32.0 - y]);
        let turned = counts(|[x, y]| [y, 32.0 - x]);
        for (x, y) in (0..32).flat_map(|y| (0..32).map(move |x| (x, y))) {
            if !on_an_edge(x, y) {
                let expected = at(&plain, x, y);
                prop_assert_eq!(at(&mirrored, 31 - x, y), expected, "left and right, ({}, {})", x, y);
                prop_assert_eq!(at(&flipped, x, 31 - y), expected, "up and down, ({}, {})", x, y);
                prop_assert_eq!(at(&turned, y, 31 - x), expected, "a quarter turn, ({}, {})", x, y);
            }
        }
    }

    /// Fronts, backs, and both: each triangle is one or the other, and culling leaves the others alone.
    #[test]
    fn culling_splits_a_draw_in_two(corners in points(8.0, 9..10)) {
        let positions: Vec<Vec4> = corners.iter().map(|&corner| FRAME.at(corner)).collect();
        let counts = |cull_mode| {
            let mut rasterizer = Rasterizer::new(FRAME.viewport());
            rasterizer.cull_mode = cull_mode;
            FRAME.counts_of(&rasterizer, Primitives::list(), &positions)
        };
        let (all, fronts, backs) = (counts(CullMode::None), counts(CullMode::Back), counts(CullMode::Front));
        let sum: Vec<u8> = fronts.iter().zip(&backs).map(|(front, back)| front + back).collect();
        prop_assert_eq!(all, sum, "fronts + backs");
    }

    /// `Setup::coverage` of a rectangle: `None` and `Full` are certain.
    #[test]
    fn setup_knows_what_it_covers_of_a_rectangle(
        corners in points(8.0, 3..4), x in -8i32..36, y in -8i32..36, width in 0u32..12, height in 0u32..12,
    ) {
        let rasterizer = Rasterizer::<()>::new(FRAME.viewport());
        let corners = [corners[0], corners[1], corners[2]].map(|corner| FRAME.at(corner));
        let Some(setup) = Setup::new(projected(&rasterizer, corners)) else { return Ok(()) };
        let rect = Rect { x, y, width, height };
        let mut covered = 0;
        setup.for_each_span(rect, |span| covered += span.end().abs_diff(span.start()));
        match setup.coverage(rect) {
            Coverage::None => prop_assert_eq!(covered, 0, "none"),
            Coverage::Full => prop_assert_eq!(covered, width * height, "full"),
            Coverage::Partial => prop_assert!(covered < width * height, "full would be said"),
        }
    }
}

/// Slivers as many as a fan can have on the half-pixel grid: every point of a square's outline.
#[test]
fn every_sample_under_a_fan_to_every_half_pixel_is_drawn_once() {
    for middle in [[16.0, 16.0], [16.5, 16.5], [0.5, 31.5], [7.5, 16.0]] {
        let side: Vec<f32> = (-2..66).map(|i| i as f32 / 2.0).collect();
        let rim: Vec<Vec4> = side
            .iter()
            .map(|&x| [x, -1.0])
            .chain(side.iter().map(|&y| [33.0, y]))
            .chain(side.iter().map(|&x| [32.0 - x, 33.0]))
            .chain(side.iter().map(|&y| [-1.0, 32.0 - y]))
            .map(|point| FRAME.at(point))
            .collect();
        let counts = FRAME.counts(&fan_around(FRAME.at(middle), &rim));
        FRAME.assert_all(&counts, "not once", |_, _, count| count == 1);
    }
}
