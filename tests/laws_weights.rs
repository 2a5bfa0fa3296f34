//! Laws of weights, depths, values and derivatives.
//!
//! Where the oracle compares with formulas, these say what the formulas are for: the weights of a fragment give back the
//! point that is seen at its sample, derivatives are what differences tend to, a plane has no depth outside its corners'.

mod common;

use common::{Frame, Mixed, Nowhere, Random, Record, config, mixed, projected, records_of};
use glam::{Vec2, Vec4};
use halfplane::{ClipDepth, Flat, Fragment, NoPerspective, Primitives, Rasterizer, Varyings, Weights};
use proptest::prelude::*;

const FRAME: Frame = Frame::new(32, 32);

/// A triangle in and around the frame: corners from the half-pixel grid, the subpixel grid or anywhere, and any depths;
/// w between 1/4 and 20.
fn triangle() -> impl Strategy<Value = [Vec4; 3]> {
    let grid = prop::sample::select(vec![2.0f32, 256.0, 1e6]);
    let corner = (-8.0f32..40.0, -8.0f32..40.0, 0.0f32..=1.0, -2.0f32..4.3);
    (grid, [corner.clone(), corner.clone(), corner]).prop_map(|(grid, corners)| {
        corners.map(|(x, y, depth, w)| {
            let snap = |x: f32| (x * grid).round() / grid;
            FRAME.place(snap(x), snap(y), depth, if w < 0.0 { 1.0 } else { w.exp2() * 0.999 })
        })
    })
}

fn fragments(triangle: [Vec4; 3], values: [Mixed; 3]) -> Vec<Record> {
    records_of(&Rasterizer::new(FRAME.viewport()), FRAME.area(), &triangle, &values)
}

const NO_VALUES: [Mixed; 3] = [([0.0; 2], NoPerspective(0.0), Flat(0)); 3];

/// The weights' combination of three vectors, without rounding to speak of.
fn combine(weights: [f64; 3], vertices: [Vec4; 3]) -> [f64; 4] {
    let vertices = vertices.map(|vertex| vertex.to_array().map(f64::from));
    [0, 1, 2, 3].map(|k| (0..3).map(|i| weights[i] * vertices[i][k]).sum())
}

/// How far from a pixel's sample a clip-space point is seen, in pixels along x and y.
fn distance_to_sample([x, y, _, w]: [f64; 4], pixel: [i32; 2]) -> f64 {
    let size = 32.0;
    let (seen_x, seen_y) = ((x / w + 1.0) * size / 2.0, (1.0 - y / w) * size / 2.0);
    (seen_x - f64::from(pixel[0]) - 0.5).abs().max((seen_y - f64::from(pixel[1]) - 0.5).abs())
}

proptest! {
    #![proptest_config(config(200))]

    /// P = αA + βB + γC, in clip space, is seen at the sample: within the 1/512 pixel of rounding the corners, and 2⁻¹²
    /// for weights of 2⁻²⁰ times coordinates of 64 pixels with w of 1 to 20.
    #[test]
    fn weights_give_back_the_point_at_the_sample(triangle in triangle()) {
        for record in fragments(triangle, NO_VALUES) {
            let weights = record.weights.map(|bits| f64::from(f32::from_bits(bits)));
            let error = distance_to_sample(combine(weights, triangle), [record.x, record.y]);
            prop_assert!(error < 1.0 / 512.0 + 1.0 / 4096.0, "{} px: {:?}", error, record);
        }
    }

    /// The same of barycentrics, on the screen.
    #[test]
    fn barycentrics_give_back_the_sample(triangle in triangle()) {
        let on_screen = triangle.map(|vertex| vertex / vertex.w);
        for record in fragments(triangle, NO_VALUES) {
            let barycentrics = record.barycentrics.map(|bits| f64::from(f32::from_bits(bits)));
            let error = distance_to_sample(combine(barycentrics, on_screen), [record.x, record.y]);
            prop_assert!(error < 1.0 / 512.0 + 1.0 / 4096.0, "{} px: {:?}", error, record);
        }
    }

    /// The clip-space position, interpolated like any other value, is seen at the sample, and its z/w is the depth.
    #[test]
    fn positions_interpolate_to_the_position_at_the_sample(triangle in triangle()) {
        let mut worst = (0.0f64, 0.0f64);
        Rasterizer::<Vec4>::new(FRAME.viewport())
            .draw(&mut Nowhere::new(FRAME.area()), Primitives::list(), &triangle, &triangle, |fragment| {
                let point = fragment.varyings().to_array().map(f64::from);
                let error = distance_to_sample(point, [fragment.x(), fragment.y()]);
                let depth = (point[2] / point[3] - f64::from(fragment.depth())).abs();
                worst = (worst.0.max(error), worst.1.max(depth));
            })
            .expect("legal input");
        prop_assert!(worst.0 < 1.0 / 512.0 + 1.0 / 2048.0, "{} px", worst.0);
        prop_assert!(worst.1 < 1.0 / f64::from(1 << 16), "depth off by {}", worst.1);
    }

    /// Sums are 1 and no weight leaves 0 ..= 1, to 2⁻²⁰.
    #[test]
    fn weights_sum_to_one_and_stay_within(triangle in triangle()) {
        const BOUND: f32 = 1.0 / (1 << 20) as f32;
        for record in fragments(triangle, NO_VALUES) {
            for weights in [record.weights.map(f32::from_bits), record.barycentrics.map(f32::from_bits)] {
                prop_assert!((weights.iter().sum::<f32>() - 1.0).abs() <= BOUND, "sum: {:?}", weights);
                prop_assert!(weights.iter().all(|w| (-BOUND..=1.0 + BOUND).contains(w)), "range: {:?}", weights);
            }
        }
    }

    /// What all three vertices have, every fragment has, to the bit; and it does not change.
    #[test]
    fn equal_values_stay_equal(triangle in triangle(), value in -1e6f32..1e6) {
        for record in fragments(triangle, [mixed(value, -value, 3); 3]) {
            prop_assert_eq!(record.values, [value.to_bits(), (-value).to_bits(), value.to_bits(), 3], "values");
            let still = |bits: [u32; 4]| bits[..3].iter().all(|&b| f32::from_bits(b) == 0.0) && bits[3] == 3;
            prop_assert!(still(record.values_dx) && still(record.values_dy), "derivatives: {:?}", record);
        }
    }

    /// Values are the weights' mean of the vertices' values, NoPerspective ones the barycentrics', and Flat ones one of
    /// them.
    #[test]
    fn values_are_means_by_the_weights(triangle in triangle(), vertices in prop::array::uniform3(-100.0f32..100.0)) {
        for record in fragments(triangle, [0, 1, 2].map(|i| mixed(vertices[i], -vertices[i], [5, 6, 7][i]))) {
            let mean = |weights: [u32; 3]| -> f64 {
                (0..3).map(|i| f64::from(f32::from_bits(weights[i])) * f64::from(vertices[i])).sum()
            };
            let error = |bits: u32, mean: f64| (f64::from(f32::from_bits(bits)) - mean).abs();
            prop_assert!(error(record.values[0], mean(record.weights)) < 2e-4, "smooth: {:?}", record);
            prop_assert!(error(record.values[1], -mean(record.weights)) < 2e-4, "smooth: {:?}", record);
            prop_assert!(error(record.values[2], mean(record.barycentrics)) < 2e-4, "no perspective: {:?}", record);
            prop_assert_eq!(record.values[3], 5, "flat");
        }
    }

    /// Derivatives are what differences over ever smaller distances tend to: here central ones of 1/4096 pixel, of the value
    /// in `f64`.
    #[test]
    fn derivatives_are_the_limit_of_differences(triangle in triangle(), vertices in prop::array::uniform3(-4.0f32..4.0)) {
        let corners = projected(&Rasterizer::<()>::new(FRAME.viewport()), triangle);
        let at = corners.map(|v| v.position_subpixel().expect("near").map(|c| f64::from(c) / 256.0));
        let edge = |p: [f64; 2], q: [f64; 2], [x, y]: [f64; 2]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let parts = |s: [f64; 2]| [edge(at[1], at[2], s), edge(at[2], at[0], s), edge(at[0], at[1], s)];
        let mean = |parts: [f64; 3]| {
            let weighted: f64 = (0..3).map(|i| parts[i] * f64::from(vertices[i])).sum();
            weighted / parts.iter().sum::<f64>()
        };
        let linear = |s: [f64; 2]| mean(parts(s));
        let smooth = |s: [f64; 2]| {
            let parts = parts(s);
            mean([0, 1, 2].map(|i| parts[i] * f64::from(corners[i].inv_w())))
        };
        // Needles change without end across their width, and differences cannot follow.
        let area = edge(at[0], at[1], at[2]).abs();
        prop_assume!(area > 8.0, "two pixels");
        for record in fragments(triangle, vertices.map(|v| mixed(v, v, 0))) {
            const H: f64 = 1.0 / 4096.0;
            let [x, y] = [record.x, record.y].map(|c| f64::from(c) + 0.5);
            let dx = |f: &dyn Fn([f64; 2]) -> f64| (f([x + H, y]) - f([x - H, y])) / (2.0 * H);
            let dy = |f: &dyn Fn([f64; 2]) -> f64| (f([x, y + H]) - f([x, y - H])) / (2.0 * H);
            let float = |bits: u32| f64::from(f32::from_bits(bits));
            for (told, limit) in [
                (record.values_dx[0], dx(&smooth)),
                (record.values_dy[0], dy(&smooth)),
                (record.values_dx[2], dx(&linear)),
                (record.values_dy[2], dy(&linear)),
            ] {
                let error = (float(told) - limit).abs();
                prop_assert!(error < 5e-3 * (1.0 + limit.abs()), "{} is not {limit}: {:?}", float(told), record);
            }
        }
    }

    /// Depth is that of a plane: never outside its corners' by more than 2⁻²², never outside the viewport's range at all,
    /// and along a row it goes one way only.
    #[test]
    fn depth_stays_in_range_and_is_monotonic_along_rows(
        triangle in triangle(), range in [0.0f32..=1.0, 0.0f32..=1.0],
    ) {
        let viewport = FRAME.viewport().with_depth_range(range[0], range[1]).expect("legal");
        let rasterizer = Rasterizer::new(viewport);
        let depths = projected(&rasterizer, triangle).map(|vertex| vertex.depth());
        let (low, high) = depths.iter().fold((2.0f32, -1.0f32), |(l, h), &d| (l.min(d), h.max(d)));
        let records = records_of(&rasterizer, FRAME.area(), &triangle, &NO_VALUES);
        for record in &records {
            let depth = f32::from_bits(record.depth);
            prop_assert!(depth >= low - 2.5e-7 && depth <= high + 2.5e-7, "{} of {:?}", depth, depths);
            prop_assert!(depth >= range[0].min(range[1]) && depth <= range[0].max(range[1]), "{} of {:?}", depth, range);
        }
        for y in 0..32 {
            let row: Vec<f32> =
                records.iter().filter(|record| record.y == y).map(|record| f32::from_bits(record.depth)).collect();
            prop_assert!(row.is_sorted() || row.iter().rev().is_sorted(), "row {}: {:?}", y, row);
        }
    }

    /// OpenGL's clip space is the other one with z' = 2z − w.
    #[test]
    fn both_clip_spaces_show_the_same(triangle in triangle()) {
        let mut rasterizer = Rasterizer::new(FRAME.viewport());
        let one = records_of(&rasterizer, FRAME.area(), &triangle, &NO_VALUES);
        rasterizer.clip_depth = ClipDepth::NegativeOneToOne;
        let gl = triangle.map(|v| v.with_z((2.0 * v.z - v.w).clamp(-v.w, v.w)));
        let other = records_of(&rasterizer, FRAME.area(), &gl, &NO_VALUES);
        prop_assert_eq!(one.len(), other.len(), "coverage");
        for (one, other) in one.iter().zip(&other) {
            let difference = f32::from_bits(one.depth) - f32::from_bits(other.depth);
            prop_assert!(difference.abs() < 1e-6, "{:?} {:?}", one, other);
            prop_assert_eq!(one.weights, other.weights, "depth apart");
        }
    }
}

#[test]
fn perspective_bends_values_and_no_perspective_does_not() {
    // A rectangle that leans back: w = 1 on the left and 4 on the right, u from 0 to 1. Half way on the screen u is
    // (½ · 1/4) / (½ · 1 + ½ · 1/4) = 1/5.
    let corner = |x, y, w| FRAME.place(x, y, 0.5, w);
    let positions = [corner(0.5, -40.0, 1.0), corner(0.5, 80.0, 1.0), corner(16.5, 0.0, 4.0)];
    let values = [(0.0, NoPerspective(0.0)), (0.0, NoPerspective(0.0)), (1.0, NoPerspective(1.0))];
    let mut middle = Vec2::ZERO;
    Rasterizer::<(f32, NoPerspective<f32>)>::new(FRAME.viewport())
        .draw(&mut Nowhere::new(FRAME.area()), Primitives::list(), &positions, &values, |fragment| {
            if (fragment.x(), fragment.y()) == (8, 8) {
                let (smooth, NoPerspective(linear)) = fragment.varyings();
                middle = Vec2::new(smooth, linear);
            }
        })
        .expect("legal input");
    assert!((middle - Vec2::new(0.2, 0.5)).abs().max_element() < 1e-6, "{middle}");
}

#[test]
fn random_numbers_are_what_they_say() {
    let mut random = Random::new(1);
    for _ in 0..1000 {
        let (integer, float) = (random.between(-3, 2), random.range(2.0, 3.0));
        assert!((-3..=2).contains(&integer) && (2.0..3.0).contains(&float), "{integer} {float}");
    }
}

/// An angle, a full turn of which is 1: vertices are interpolated the short way round.
#[derive(Clone, Copy)]
struct Turn(f32);

impl Varyings for Turn {
    fn interpolate([a, b, c]: &[Self; 3], weights: &Weights) -> Self {
        let near = |other: &Self| other.0 - (other.0 - a.0).round();
        Self(weights.smooth([a.0, near(b), near(c)]))
    }
}

/// What a closure is told of a triangle: the value and its change along x, fragment by fragment, left to right.
fn values_and_changes<V: Varyings>(
    triangle: [Vec4; 3],
    vertices: [V; 3],
    number: fn(V) -> f32,
) -> Vec<[f32; 2]> {
    let mut told = Vec::new();
    let mut nowhere = Nowhere::new(FRAME.area());
    let rasterizer = Rasterizer::new(FRAME.viewport());
    let drawn = rasterizer.draw(
        &mut nowhere,
        Primitives::list(),
        &triangle,
        &vertices,
        |fragment: Fragment<'_, V>| {
            told.push([number(fragment.varyings()), number(fragment.varyings_dx())]);
        },
    );
    assert!(drawn.is_ok() && !told.is_empty(), "it is drawn");
    told
}

/// A triangle over most of the frame, seen in perspective.
fn slanted() -> [Vec4; 3] {
    let corners = [(-14.0, -14.0, 1.0), (46.0, -14.0, 4.0), (16.0, 46.0, 2.0)];
    corners.map(|(x, y, w)| FRAME.place(x, y, 0.5, w))
}

/// `interpolate` by hand may do what it likes with the vertices' values, as long as the result is linear in the weights.
#[test]
fn values_interpolated_by_hand_have_the_change_of_what_they_are() {
    let turns = values_and_changes(slanted(), [Turn(0.9), Turn(0.1), Turn(0.3)], |turn| turn.0);
    let unwrapped = values_and_changes(slanted(), [0.9f32, 1.1, 1.3], |turn| turn);
    assert_eq!(turns.len(), unwrapped.len(), "the same fragments");
    for (found, expected) in turns.iter().zip(&unwrapped) {
        let is_near = |i: usize| (found[i] - expected[i]).abs() < 1e-6;
        assert!(is_near(0) && is_near(1), "value and change {found:?}, not {expected:?}");
    }
}

/// Changes of large values are finite, and in proportion.
#[test]
fn large_values_have_large_changes() {
    let usual = values_and_changes(slanted(), [1.0f32, -0.5, 2.0], |value| value);
    let large = values_and_changes(slanted(), [1e32f32, -0.5e32, 2e32], |value| value);
    for (usual, large) in usual.iter().zip(&large) {
        let error = (large[1] / 1e32 - usual[1]).abs();
        assert!(error < 1e-6, "{} is not 1e32 times {}", large[1], usual[1]);
    }
}
