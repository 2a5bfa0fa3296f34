//! Laws of what happens to a fragment: the depth test in every format, discard, blending, depth bias.
//!
//! The model is a loop over fragments that does what the specification says, one fragment at a time, with an ordinary
//! comparison.

mod common;

use core::fmt::Debug;

use common::{Frame, Nowhere, Random, config, projected};
use glam::Vec4;
use halfplane::{
    Always, CompareOp, Depth24, DepthBias, DepthFormat, DepthState, DepthTest, Equal, Greater,
    GreaterOrEqual, Less, LessOrEqual, Never, NotEqual, Primitives, Rasterizer, ReadOnly, Surface,
};
use proptest::prelude::*;

const FRAME: Frame = Frame::new(24, 20);

const OPS: [CompareOp; 8] = [
    CompareOp::Never,
    CompareOp::Less,
    CompareOp::Equal,
    CompareOp::LessOrEqual,
    CompareOp::Greater,
    CompareOp::NotEqual,
    CompareOp::GreaterOrEqual,
    CompareOp::Always,
];

/// A few triangles that intersect, small and large, some at depths that others have exactly.
fn scene(seed: u64) -> Vec<Vec4> {
    let random = &mut Random::new(seed);
    let mut positions = Vec::new();
    for _ in 0..random.between(1, 12) {
        let level = random.choose(&[None, None, Some(0.25), Some(0.5), Some(1.0)]);
        let middle = [random.between(0, 48), random.between(0, 40)];
        // In half pixels.
        let reach = random.choose(&[[3, 3], [7, 7], [7, 40], [40, 7], [60, 60]]);
        for _ in 0..3 {
            let [x, y] = [0, 1].map(|i| (middle[i] + random.between(-reach[i], reach[i])) as f32 / 2.0);
            let depth = level.unwrap_or_else(|| random.unit());
            positions.push(FRAME.place(x, y, depth, random.choose(&[1.0, 1.0, 4.0, 0.7])));
        }
    }
    positions
}

/// A fragment before any test: its pixel, its depth, its triangle.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    pixel: usize,
    depth: f32,
    primitive: u32,
}

fn candidates(rasterizer: &Rasterizer<()>, positions: &[Vec4]) -> Vec<Candidate> {
    let mut candidates = Vec::new();
    rasterizer
        .draw(&mut Nowhere::new(FRAME.area()), Primitives::list(), positions, (), |fragment| {
            let pixel = usize::try_from(fragment.y() * 24 + fragment.x()).expect("inside");
            candidates.push(Candidate {
                pixel,
                depth: fragment.depth(),
                primitive: fragment.primitive_index(),
            });
        })
        .expect("legal input");
    candidates
}

fn compare<D: PartialOrd>(op: CompareOp, new: D, old: D) -> bool {
    match op {
        CompareOp::Never => false,
        CompareOp::Less => new < old,
        CompareOp::Equal => new == old,
        CompareOp::LessOrEqual => new <= old,
        CompareOp::Greater => new > old,
        CompareOp::NotEqual => new != old,
        CompareOp::GreaterOrEqual => new >= old,
        CompareOp::Always => true,
    }
}

/// What a shader does: discards some, and mixes what is there in an order that cannot be exchanged.
fn blend(pixel: usize, primitive: u32, below: u32) -> Option<u32> {
    let keep = (pixel * 7 + primitive as usize) % 5 != 0;
    keep.then_some(below.wrapping_mul(31).wrapping_add(primitive + 1))
}

/// A picture: colours and depths.
type Memory<D> = (Vec<u32>, Vec<D>);

/// The specification, fragment by fragment; and how many fragments were shaded and kept.
fn model<D: DepthFormat>(
    candidates: &[Candidate],
    op: CompareOp,
    write: bool,
    (mut colors, mut depths): Memory<D>,
) -> (Memory<D>, [u64; 2]) {
    let (mut shaded, mut kept) = (0, 0);
    for &Candidate { pixel, depth, primitive } in candidates {
        let new = D::from_depth(depth);
        if compare(op, new, depths[pixel]) {
            shaded += 1;
            if let Some(color) = blend(pixel, primitive, colors[pixel]) {
                kept += 1;
                colors[pixel] = color;
                if write {
                    depths[pixel] = new;
                }
            }
        }
    }
    ((colors, depths), [shaded, kept])
}

fn draw<D: DepthFormat, T: DepthTest>(
    rasterizer: &Rasterizer<(), T>,
    positions: &[Vec4],
    (mut colors, mut depths): Memory<D>,
) -> (Memory<D>, [u64; 2]) {
    let mut target = Surface::new(&mut colors, &mut depths, FRAME.width, FRAME.height).expect("it fits");
    let statistics = rasterizer
        .draw_over(&mut target, Primitives::list(), positions, (), |fragment, below| {
            let pixel = usize::try_from(fragment.y() * 24 + fragment.x()).expect("inside");
            blend(pixel, fragment.primitive_index(), below)
        })
        .expect("legal input");
    ((colors, depths), [statistics.fragments, statistics.samples_passed])
}

/// The type and the enum, both against the model, from a depth buffer with something in it.
fn check<D: DepthFormat + Debug, T: DepthTest>(
    seed: u64,
    op: CompareOp,
    test: T,
) -> Result<(), TestCaseError> {
    let positions = scene(seed);
    let random = &mut Random::new(!seed);
    let depths =
        (0..FRAME.len()).map(|_| D::from_depth(random.choose(&[0.25, 0.5, 0.75, 1.0, 0.0]))).collect();
    let memory = (vec![3; FRAME.len()], depths);
    let rasterizer = Rasterizer::new(FRAME.viewport());
    let candidates = candidates(&rasterizer, &positions);
    for write in [true, false] {
        let expected = model::<D>(&candidates, op, write, memory.clone());
        let chosen = rasterizer.with_depth_test(DepthState { compare: op, write });
        prop_assert_eq!(&draw(&chosen, &positions, memory.clone()), &expected, "{:?} at run time", op);
        let actual = if write {
            draw(&rasterizer.with_depth_test(test), &positions, memory.clone())
        } else {
            draw(&rasterizer.with_depth_test(ReadOnly(test)), &positions, memory.clone())
        };
        prop_assert_eq!(&actual, &expected, "{:?} as a type", op);
    }
    Ok(())
}

fn check_every_comparison<D: DepthFormat + Debug>(seed: u64) -> Result<(), TestCaseError> {
    check::<D, _>(seed, CompareOp::Never, Never)?;
    check::<D, _>(seed, CompareOp::Less, Less)?;
    check::<D, _>(seed, CompareOp::Equal, Equal)?;
    check::<D, _>(seed, CompareOp::LessOrEqual, LessOrEqual)?;
    check::<D, _>(seed, CompareOp::Greater, Greater)?;
    check::<D, _>(seed, CompareOp::NotEqual, NotEqual)?;
    check::<D, _>(seed, CompareOp::GreaterOrEqual, GreaterOrEqual)?;
    check::<D, _>(seed, CompareOp::Always, Always)
}

/// The fixed-point value as the table of `DepthFormat` has it.
fn fixed(depth: f32, max: f64) -> f64 {
    (f64::from(depth) * max).round_ties_even()
}

fn depth() -> impl Strategy<Value = f32> {
    prop_oneof![
        0.0f32..=1.0,
        0.0f32..1e-4,
        Just(0.0),
        Just(1.0),
        Just(0.5),
        (0u32..=65_535).prop_map(|n| n as f32 / 65_535.0)
    ]
}

proptest! {
    #![proptest_config(config(25))]

    #[test]
    fn depth_tests_are_the_comparisons_that_they_say_in_f32(seed in any::<u64>()) {
        check_every_comparison::<f32>(seed)?;
    }

    #[test]
    fn depth_tests_are_the_comparisons_that_they_say_in_u16(seed in any::<u64>()) {
        check_every_comparison::<u16>(seed)?;
    }

    #[test]
    fn depth_tests_are_the_comparisons_that_they_say_in_24_bits(seed in any::<u64>()) {
        check_every_comparison::<Depth24>(seed)?;
    }

    #[test]
    fn depth_tests_are_the_comparisons_that_they_say_in_u32(seed in any::<u64>()) {
        check_every_comparison::<u32>(seed)?;
    }

    /// Without a depth buffer every fragment passes, whatever the test.
    #[test]
    fn without_a_depth_buffer_every_fragment_passes(seed in any::<u64>(), op in 0usize..8, write in any::<bool>()) {
        let positions = scene(seed);
        let rasterizer = Rasterizer::new(FRAME.viewport());
        let all = vec![(); FRAME.len()];
        let candidates = candidates(&rasterizer, &positions);
        let expected = model::<()>(&candidates, CompareOp::Always, true, (vec![3; FRAME.len()], all));
        let mut colors = vec![3; FRAME.len()];
        let mut target = Surface::color_only(&mut colors, FRAME.width, FRAME.height).expect("it fits");
        let statistics = rasterizer
            .with_depth_test(DepthState { compare: OPS[op], write })
            .draw_over(&mut target, Primitives::list(), &positions[..], (), |fragment, below| {
                let pixel = usize::try_from(fragment.y() * 24 + fragment.x()).expect("inside");
                blend(pixel, fragment.primitive_index(), below)
            })
            .expect("legal input");
        prop_assert_eq!((&colors, [statistics.fragments, statistics.samples_passed]), (&expected.0.0, expected.1), "all");
    }

    /// A depth-only pass stores what a pass with colours stores.
    #[test]
    fn depth_alone_is_the_depth_of_the_whole(seed in any::<u64>()) {
        let positions = scene(seed);
        let rasterizer = Rasterizer::<()>::new(FRAME.viewport());
        let (mut colors, mut depths) = (vec![0u8; FRAME.len()], vec![u16::MAX; FRAME.len()]);
        let mut target = Surface::new(&mut colors, &mut depths, FRAME.width, FRAME.height).expect("it fits");
        let both = rasterizer.draw(&mut target, Primitives::list(), &positions[..], (), |_| 1u8);
        let mut alone = vec![u16::MAX; FRAME.len()];
        let mut target = Surface::depth_only(&mut alone, FRAME.width, FRAME.height).expect("it fits");
        let only = rasterizer.draw(&mut target, Primitives::list(), &positions[..], (), |_| ());
        prop_assert_eq!((both, &depths), (only, &alone), "a closure that does nothing");
        let mut without = vec![u16::MAX; FRAME.len()];
        let mut target = Surface::depth_only(&mut without, FRAME.width, FRAME.height).expect("it fits");
        let none = rasterizer.draw_depth(&mut target, Primitives::list(), &positions[..]);
        prop_assert_eq!((both, &depths), (none, &without), "no closure");
    }
}

proptest! {
    #![proptest_config(config(300))]

    /// Formats round to the nearest value (the 16-bit one after rounding the product to `f32`), and never swap two
    /// depths.
    #[test]
    fn depth_formats_are_nearest_and_monotonic(a in depth(), b in depth()) {
        let product = f64::from(a * 65_535.0);
        prop_assert_eq!(f64::from(u16::from_depth(a)), product.round_ties_even(), "u16 of {}", a);
        prop_assert_eq!(f64::from(Depth24::from_depth(a).0), fixed(a, 16_777_215.0), "24 bits of {}", a);
        prop_assert_eq!(f64::from(u32::from_depth(a)), fixed(a, 4_294_967_295.0), "u32 of {}", a);
        prop_assert_eq!(f32::from_depth(a), a, "f32");
        let (low, high) = (a.min(b), a.max(b));
        prop_assert!(u16::from_depth(low) <= u16::from_depth(high), "u16");
        prop_assert!(Depth24::from_depth(low) <= Depth24::from_depth(high), "24 bits");
        prop_assert!(u32::from_depth(low) <= u32::from_depth(high), "u32");
    }

    /// bias = constant · r + slope · m, limited to `clamp` on the side of its sign; then into the viewport's range.
    #[test]
    fn depth_bias_is_the_formula(
        corners in prop::array::uniform3((-4.0f32..28.0, -4.0f32..24.0, 0.0f32..1.0)),
        constant in prop::sample::select(vec![0.0f32, 1.0, -3.0, 1e4]),
        slope in prop::sample::select(vec![0.0f32, 0.5, 2.0, -1.5]),
        limit in prop::sample::select(vec![0.0f32, 0.01, -0.01, 0.3]),
        range in prop::sample::select(vec![[0.0f32, 1.0], [1.0, 0.0], [0.25, 0.5]]),
    ) {
        let viewport = FRAME.viewport().with_depth_range(range[0], range[1]).expect("legal");
        let plain = Rasterizer::<()>::new(viewport);
        let positions = corners.map(|(x, y, depth)| FRAME.place(x, y, depth, 1.0));
        // The plane of depth, from the corners on the subpixel grid.
        let vertices = projected(&plain, positions);
        let [a, b, c] = vertices.map(|v| {
            let [x, y] = v.position_subpixel().expect("near").map(|c| f64::from(c) / 256.0);
            [x, y, f64::from(v.depth())]
        });
        let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
        let area = u[0] * v[1] - u[1] * v[0];
        prop_assume!(area.abs() > 1.0);
        let steepest = ((u[2] * v[1] - u[1] * v[2]) / area).abs().max(((u[0] * v[2] - u[2] * v[0]) / area).abs());
        let largest = vertices.iter().map(|v| v.depth()).fold(0.0, f32::max);

        let mut biased = plain;
        biased.depth_bias = DepthBias { constant, slope, clamp: limit };
        let unit_of_f32 = f64::from(largest.next_up() - largest);
        prop_assert!(largest > 1e-30, "denormals have a smaller unit");
        let formats = [
            (depths::<f32>(&plain, &biased, &positions), unit_of_f32),
            (depths::<u16>(&plain, &biased, &positions), 1.0 / 65_535.0),
            (depths::<Depth24>(&plain, &biased, &positions), 1.0 / 16_777_215.0),
            (depths::<u32>(&plain, &biased, &positions), 1.0 / 4_294_967_296.0),
        ];
        for (pairs, unit) in formats {
            let bias = f64::from(constant) * unit + f64::from(slope) * steepest;
            let limit = f64::from(limit);
            let bias = if limit > 0.0 { bias.min(limit) } else if limit < 0.0 { bias.max(limit) } else { bias };
            let [low, high] = [range[0].min(range[1]), range[0].max(range[1])].map(f64::from);
            for (before, after) in pairs {
                // What was clamped before it was biased need not be the plane's depth.
                if before > low && before < high {
                    let expected = (before + bias).clamp(low, high);
                    prop_assert!(
                        (after - expected).abs() < 1e-6 * (1.0 + bias.abs()),
                        "{before} + {bias} is not {after}, unit {unit}"
                    );
                }
            }
        }
    }
}

/// The depths of a triangle's fragments without and with bias, in a format.
fn depths<D: DepthFormat>(
    plain: &Rasterizer<()>,
    biased: &Rasterizer<()>,
    positions: &[Vec4],
) -> Vec<(f64, f64)> {
    let draw = |rasterizer: &Rasterizer<()>| {
        let mut memory = vec![D::from_depth(0.0); FRAME.len()];
        let mut target = Surface::depth_only(&mut memory, FRAME.width, FRAME.height).expect("it fits");
        let mut depths = Vec::new();
        rasterizer
            .with_depth_test(ReadOnly(Always))
            .draw(&mut target, Primitives::list(), positions, (), |fragment| {
                depths.push(f64::from(fragment.depth()))
            })
            .expect("legal input");
        depths
    };
    draw(plain).into_iter().zip(draw(biased)).collect()
}

#[test]
fn reverse_depth_and_greater_are_depth_and_less() {
    for seed in 0..20 {
        let positions = scene(seed);
        let reversed: Vec<Vec4> = positions.iter().map(|p| p.with_z(p.w - p.z)).collect();
        let owner = |positions: &[Vec4], is_reversed: bool| {
            let (mut colors, mut depths) =
                (vec![0u32; FRAME.len()], vec![if is_reversed { 0.0f32 } else { 1.0 }; FRAME.len()]);
            let mut target =
                Surface::new(&mut colors, &mut depths, FRAME.width, FRAME.height).expect("it fits");
            let state = if is_reversed { CompareOp::Greater } else { CompareOp::Less };
            Rasterizer::<()>::new(FRAME.viewport())
                .with_depth_test(DepthState { compare: state, write: true })
                .draw(&mut target, Primitives::list(), positions, (), |fragment| {
                    fragment.primitive_index() + 1
                })
                .expect("legal input");
            colors
        };
        let (one, other) = (owner(&positions, false), owner(&reversed, true));
        let different = one.iter().zip(&other).filter(|(one, other)| one != other).count();
        // Rounding may decide otherwise along an intersection, and where two triangles lie in one plane.
        assert!(different <= FRAME.len() / 20, "seed {seed}: {different} pixels");
    }
}

#[test]
fn a_discarded_fragment_leaves_colour_and_depth_alone() {
    let positions = [[0.0, 0.0], [0.0, 60.0], [60.0, 0.0]].map(|point| FRAME.at(point));
    let (mut colors, mut depths) = (vec![9u8; FRAME.len()], vec![1.0f32; FRAME.len()]);
    let mut target = Surface::new(&mut colors, &mut depths, FRAME.width, FRAME.height).expect("it fits");
    let statistics = Rasterizer::<()>::new(FRAME.viewport())
        .draw(&mut target, Primitives::list(), &positions, (), |fragment| {
            (fragment.x() % 2 == 0).then_some(1u8)
        })
        .expect("legal input");
    for (i, (color, depth)) in colors.into_iter().zip(depths).enumerate() {
        assert_eq!((color, depth), if i % 2 == 0 { (1, 0.5) } else { (9, 1.0) }, "pixel {i}");
    }
    assert_eq!((statistics.fragments, statistics.samples_passed), (480, 240), "{statistics:?}");
}

#[test]
fn equal_depths_lose_against_less_and_win_against_less_or_equal() {
    let positions = [[0.0, 0.0], [0.0, 60.0], [60.0, 0.0]].map(|point| FRAME.at(point));
    let twice = [positions, positions];
    let draw = |compare| {
        let (mut colors, mut depths) = (vec![9u32; FRAME.len()], vec![0.5f32; FRAME.len()]);
        let mut target = Surface::new(&mut colors, &mut depths, FRAME.width, FRAME.height).expect("it fits");
        Rasterizer::<()>::new(FRAME.viewport())
            .with_depth_test(DepthState { compare, write: true })
            .draw(&mut target, Primitives::list(), twice.as_flattened(), (), |fragment| {
                fragment.primitive_index()
            })
            .expect("legal input");
        (colors.iter().min().copied(), colors.iter().max().copied())
    };
    assert_eq!(draw(CompareOp::Less), (Some(9), Some(9)), "what is as near does not replace");
    assert_eq!(draw(CompareOp::LessOrEqual), (Some(1), Some(1)), "and here it does");
}

#[test]
fn long_rows_are_tested_like_short_ones() {
    // Rows longer than any chunk that they may be worked through in, with some, all and none of a chunk passing.
    let frame = Frame::new(1500, 3);
    let triangle = [
        frame.place(-10.0, -10.0, 0.5, 1.0),
        frame.place(-10.0, 30.0, 0.5, 1.0),
        frame.place(9000.0, 0.0, 0.5, 1.0),
    ];
    for pattern in [1usize, 2, 3, 7, 100, 255, 256, 257, 512, 700] {
        let old = |i: usize| if i / pattern % 2 == 0 { 0.25f32 } else { 0.75 };
        let (mut colors, mut depths): (Vec<u32>, Vec<f32>) = (0..frame.len()).map(|i| (7, old(i))).unzip();
        let mut target = Surface::new(&mut colors, &mut depths, frame.width, frame.height).expect("it fits");
        let statistics = Rasterizer::<()>::new(frame.viewport())
            .draw(&mut target, Primitives::list(), &triangle, (), |fragment| fragment.x().unsigned_abs() + 10)
            .expect("legal input");
        let mut passed = 0;
        for (i, (color, depth)) in (0..).zip(colors.into_iter().zip(depths)) {
            let passes = old(i) == 0.75;
            passed += u64::from(passes);
            let column = u32::try_from(i % 1500).expect("small");
            assert_eq!(
                (color, depth),
                if passes { (column + 10, 0.5) } else { (7, 0.25) },
                "{pattern}: pixel {i}"
            );
        }
        assert_eq!(statistics.fragments, passed, "{statistics:?}");
    }
}
