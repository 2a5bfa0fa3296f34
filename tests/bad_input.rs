//! No input breaks it: nothing here may panic, overflow or hang, and what is wrong is told or counted.

mod common;

use core::cell::Cell;

use common::{Frame, HAS_SIMD, Mixed, Nowhere, Random, Record, config, effort, mixed, records_of};
use glam::Vec4;
use halfplane::{
    Absent, Attribute, Attributes, Block, ClipDepth, Computed, CullMode, Depth24, DepthBias, DepthClip,
    DrawError, Fragment, Framebuffer, FrontFace, IndexBuffer, Less, Primitives, ProjectedVertex,
    ProvokingVertex, Rasterizer, Rect, Run, Setup, Span, Statistics, Surface, SurfaceError, Topology,
    Viewport, ViewportError,
};
use proptest::prelude::*;

/// Numbers that have broken rasterizers.
const NASTY: [f32; 30] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    2.0,
    -2.0,
    1e-45,
    -1e-45,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    1e-30,
    -1e-20,
    5.421_011e-20, // 2⁻⁶⁴
    5.421_01e-20,
    1e10,
    -1e10,
    16_383.0,
    -16_384.0,
    1e30,
    -1e30,
    1.267_650_6e30, // 2¹⁰⁰
    1.267_650_7e30,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    -f32::NAN,
];

fn nasty() -> impl Strategy<Value = f32> {
    prop_oneof![
        3 => prop::sample::select(NASTY.to_vec()),
        3 => -2.0f32..2.0,
        1 => any::<u32>().prop_map(f32::from_bits),
    ]
}

fn nasty_vertex() -> impl Strategy<Value = Vec4> {
    prop_oneof![
        [nasty(), nasty(), nasty(), nasty()].prop_map(Vec4::from_array),
        // Something to see, mostly.
        [-1.5f32..1.5, -1.5f32..1.5, -0.5f32..1.5, 0.5f32..2.0].prop_map(Vec4::from_array),
        ([-1.5f32..1.5, -1.5f32..1.5, 0.0f32..1.0], nasty()).prop_map(|([x, y, z], w)| Vec4::new(x, y, z, w)),
    ]
}

/// Statistics that hold together.
fn assert_sound(statistics: Statistics, triangles: usize) {
    let Statistics {
        primitives,
        invalid,
        outside,
        clipped,
        culled,
        degenerate,
        fragments,
        samples_passed,
        ..
    } = statistics;
    assert_eq!(primitives, triangles as u64, "{statistics:?}");
    assert!(invalid + outside + culled + degenerate <= primitives, "{statistics:?}");
    assert!(clipped + invalid + outside <= primitives, "{statistics:?}");
    assert!(samples_passed <= fragments, "{statistics:?}");
}

proptest! {
    #![proptest_config(config(400))]

    /// Any vertices, any state.
    #[test]
    fn no_vertex_breaks_a_draw(
        vertices in prop::collection::vec(nasty_vertex(), 0..9), seed in any::<u64>(),
        viewport in [-40.0f32..40.0, -40.0f32..40.0, 0.01f32..64.0, -64.0f32..64.0],
    ) {
        let random = &mut Random::new(seed);
        let [x, y, width, height] = viewport;
        let viewport = Viewport::new(x, y, width, height + 0.01)
            .and_then(|viewport| viewport.with_depth_range(random.unit(), random.unit()))
            .expect("legal");
        let mut rasterizer = Rasterizer::<Mixed>::new(viewport);
        rasterizer.cull_mode = random.choose(&[CullMode::None, CullMode::Front, CullMode::Back]);
        rasterizer.front_face = random.choose(&[FrontFace::CounterClockwise, FrontFace::Clockwise]);
        rasterizer.clip_depth = random.choose(&[ClipDepth::ZeroToOne, ClipDepth::NegativeOneToOne]);
        rasterizer.depth_clip = random.choose(&[DepthClip::Clip, DepthClip::Clamp]);
        rasterizer.provoking_vertex = random.choose(&[ProvokingVertex::First, ProvokingVertex::Last]);
        let number = |random: &mut Random| random.choose(&NASTY);
        if random.between(0, 1) == 0 {
            rasterizer.depth_bias = DepthBias { constant: number(random), slope: number(random), clamp: number(random) };
        }
        let area = Rect { x: random.between(-9, 9), y: random.between(-9, 9), width: 16, height: 16 };
        let values: Vec<Mixed> = vertices.iter().map(|_| mixed(number(random), 1.0, 2)).collect();
        let topology = random.choose(&[Topology::List, Topology::Strip, Topology::Fan]);
        let (mut colors, mut depths) = ([0u32; 256], [Depth24::default(); 256]);
        let mut target = Surface::with_planes(&mut colors[..], &mut depths[..], area, 16).expect("it fits");
        let statistics = rasterizer
            .draw(&mut target, Primitives::new(topology), &vertices[..], &values[..], |fragment| {
                let record = Record::of(&fragment);
                // Whatever the vertices: in the frame, with a depth in the viewport's range.
                assert!(area.contains(record.x, record.y) && record.depth <= 1.0f32.to_bits(), "{record:?}");
                record.weights[0]
            })
            .expect("legal input");
        let triangles = if topology == Topology::List { vertices.len() / 3 } else { vertices.len().saturating_sub(2) };
        assert_sound(statistics, triangles);
    }

    /// Weights are numbers, in range, whatever lies behind the eye or far away.
    #[test]
    fn weights_are_weights_for_any_vertices(vertices in prop::array::uniform3(nasty_vertex())) {
        const BOUND: f32 = 1.0 / (1 << 20) as f32;
        let frame = Frame::new(16, 16);
        for depth_clip in [DepthClip::Clip, DepthClip::Clamp] {
            let mut rasterizer = Rasterizer::new(frame.viewport());
            rasterizer.depth_clip = depth_clip;
            for record in records_of(&rasterizer, frame.area(), &vertices, &[mixed(1.0, 2.0, 3); 3]) {
                let weights = record.weights.map(f32::from_bits);
                prop_assert!(weights.iter().all(|w| (-BOUND..=1.0 + BOUND).contains(w)), "{:?}", weights);
                prop_assert!((weights.iter().sum::<f32>() - 1.0).abs() <= BOUND, "{:?}", weights);
                let value = f32::from_bits(record.values[0]);
                prop_assert!((value - 1.0).abs() < 1e-5, "{}", value);
                let depth = f32::from_bits(record.depth);
                prop_assert!((0.0..=1.0).contains(&depth), "{}", depth);
            }
        }
    }

    /// Rectangles of any kind as scissors, areas and queries.
    #[test]
    fn no_rectangle_breaks_anything(
        rects in prop::array::uniform2((any::<i32>(), any::<i32>(), any::<u32>(), any::<u32>())), small in any::<bool>(),
    ) {
        let [scissor, other] = rects.map(|(x, y, width, height)| {
            if small {
                Rect { x: x >> 26, y: y >> 26, width: width >> 26, height: height >> 26 }
            } else {
                Rect { x, y, width, height }
            }
        });
        let both = scissor.intersection(other);
        prop_assert!(both.is_empty() || scissor.contains(both.x, both.y) && other.contains(both.x, both.y), "{:?}", both);
        prop_assert_eq!(both.is_empty(), other.intersection(scissor).is_empty(), "either way");
        let frame = Frame::new(16, 16);
        let mut rasterizer = Rasterizer::<()>::new(frame.viewport());
        rasterizer.scissor = Some(scissor);
        let all = [[-16.0, -16.0], [-16.0, 64.0], [64.0, -16.0]].map(|point| frame.at(point));
        let counts = frame.counts_of(&rasterizer, Primitives::list(), &all);
        let complaint = frame.complaint(&counts, |x, y, count| count == i64::from(scissor.contains(x, y)));
        prop_assert!(complaint.is_none(), "{complaint:?}");
        let mut large = Rasterizer::<()>::new(Frame::new(Strict::SIZE, Strict::SIZE).viewport());
        large.scissor = Some(scissor);
        large.prefetch(&mut Strict::new(false));

        let setup = Setup::new(common::projected(&rasterizer, all)).expect("an area");
        let _ = setup.coverage(other);
        let visible = other.intersection(frame.area());
        setup.for_each_span(visible, |span: Span| assert!(visible.contains(span.start(), span.y()), "{span:?}"));
        let (mut none, empty): ([u8; 0], _) = ([], Rect { width: 0, ..other });
        prop_assert!(Surface::with_planes(&mut none[..], Absent::default(), empty, 0).is_ok(), "an empty surface");
    }

    /// Viewports are refused with the number that is wrong, or work.
    #[test]
    fn no_viewport_breaks_a_draw(numbers in [nasty(), nasty(), nasty(), nasty(), nasty(), nasty()]) {
        let [x, y, width, height, near, far] = numbers;
        match Viewport::new(x, y, width, height) {
            Ok(viewport) => {
                let viewport = viewport.with_depth_range(near, far).unwrap_or(viewport);
                let all = [[-1.0, -1.0], [-1.0, 3.0], [3.0, -1.0]].map(|[x, y]| Vec4::new(x, y, 0.5, 1.0));
                let area = Rect { x: -8, y: -8, width: 16, height: 16 };
                let _ = records_of(&Rasterizer::new(viewport), area, &all, &[mixed(0.0, 0.0, 0); 3]);
            }
            Err(ViewportError::Width(w)) => prop_assert!(!(w > 0.0 && w.is_finite()), "{}", w),
            Err(ViewportError::Height(h)) => prop_assert!(h == 0.0 || !h.is_finite(), "{}", h),
            Err(ViewportError::OutOfRange(side)) => prop_assert!(!(-16_384.0..=16_384.0).contains(&side), "{}", side),
            Err(error) => prop_assert!(false, "{}", error),
        }
    }

    /// Surfaces of any size over slices of any length: refused, or as large as they say.
    #[test]
    fn surfaces_refuse_what_does_not_fit(
        x in -20i32..20, y in -20i32..20, width in 0u32..9, height in 0u32..9, stride in 0usize..12,
        color in 0usize..60, depth in 0usize..60, split in -30i32..30, rows in 0u32..12,
    ) {
        let (mut colors, mut depths) = ([0u8; 60], [1.0f32; 60]);
        let (colors, depths) = (&mut colors[..color], &mut depths[..depth]);
        let area = Rect { x, y, width, height };
        let (wide, high) = (width as usize, height as usize);
        let needed = if wide * high == 0 { 0 } else { stride * (high - 1) + wide };
        match Surface::with_planes(&mut *colors, &mut *depths, area, stride) {
            Ok(surface) => {
                prop_assert!(stride >= wide && needed <= color.min(depth), "too much was believed");
                let (above, below) = surface.split_at_row(split);
                prop_assert_eq!(above.area().height + below.area().height, height, "every row");
                let mut counted = 0;
                for mut band in above.bands(rows).chain(below.bands(rows)) {
                    let area = band.area();
                    counted += area.height * u32::from(width > 0);
                    for y in area.y..area.bottom() {
                        let run = band.run(area.x, y, wide);
                        prop_assert_eq!((run.color.len(), run.depth.len()), (wide, wide), "a run of row {}", y);
                        run.color.iter_mut().for_each(|color| *color += 1);
                    }
                }
                prop_assert_eq!(counted, height * u32::from(width > 0), "every row in a band");
                let drawn = colors.iter().filter(|&&color| color == 1).count();
                prop_assert_eq!(drawn, wide * high, "every pixel once");
            }
            Err(SurfaceError::StrideTooSmall { .. }) => prop_assert!(stride < wide, "stride"),
            Err(SurfaceError::TooShort { plane, len, needed: told }) => {
                prop_assert_eq!(told, needed, "needed");
                prop_assert_eq!((plane, len), if color < needed { ("color", color) } else { ("depth", depth) }, "which");
                prop_assert!(len < needed, "it fits");
            }
            Err(error) => prop_assert!(false, "{}", error),
        }
    }
}

#[test]
fn vertices_that_are_no_points_are_skipped_and_counted() {
    let frame = Frame::new(16, 16);
    let good = [[0.0, 0.0], [0.0, 16.0], [16.0, 0.0]].map(|point| frame.at(point));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN] {
        for vertex in 0..3 {
            for coordinate in 0..4 {
                let mut positions = [good, good].concat();
                positions[vertex][coordinate] = bad;
                let mut target = Nowhere::new(frame.area());
                let statistics = Rasterizer::<()>::new(frame.viewport())
                    .draw(&mut target, Primitives::list(), &positions[..], (), |_| ())
                    .expect("legal input");
                assert_eq!(
                    (statistics.primitives, statistics.invalid),
                    (2, 1),
                    "{bad} at {coordinate} of {vertex}"
                );
                assert_eq!(statistics.fragments, 16 * 15 / 2, "the other one is drawn: {statistics:?}");
            }
        }
    }
}

#[test]
fn coordinates_of_1e30_are_points() {
    let frame = Frame::new(16, 16);
    let far = 1e30;
    let positions = [
        // Too large for its edges to be anywhere in particular.
        Vec4::new(-far, -far, 0.5, 1.0),
        Vec4::new(far, -far, 0.5, 1.0),
        Vec4::new(0.0, far, 0.5, 1.0),
        // The same at a w of 1e30: an ordinary triangle.
        Vec4::new(-far, -far, 0.5 * far, far),
        Vec4::new(far, -far, 0.5 * far, far),
        Vec4::new(0.0, far, 0.5 * far, far),
        // And at w = 1e-12.
        Vec4::new(-1e-12, -1e-12, 0.5e-12, 1e-12),
        Vec4::new(1e-12, -1e-12, 0.5e-12, 1e-12),
        Vec4::new(0.0, 1e-12, 0.5e-12, 1e-12),
    ];
    let mut fragments = [0; 3];
    let statistics = Rasterizer::<()>::new(frame.viewport())
        .draw(&mut Nowhere::new(frame.area()), Primitives::list(), &positions, (), |fragment| {
            fragments[fragment.primitive_index() as usize] += 1;
        })
        .expect("legal input");
    assert_eq!(statistics.invalid, 0, "{statistics:?}");
    assert_eq!(fragments[1..], [128, 128], "{statistics:?}");
}

#[test]
fn w_of_zero_and_below_is_behind() {
    let frame = Frame::new(16, 16);
    for w in [0.0, -0.0, -1e-30, -1.0, -1e30, 1e-45, -f32::MIN_POSITIVE] {
        let positions = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0]].map(|[x, y]| Vec4::new(x, y, 0.0, w));
        let statistics = Rasterizer::<()>::new(frame.viewport())
            .draw(&mut Nowhere::new(frame.area()), Primitives::list(), &positions, (), |_| ())
            .expect("legal input");
        assert_eq!((statistics.outside, statistics.fragments), (1, 0), "w = {w}: {statistics:?}");
    }
}

#[test]
fn no_area_is_degenerate() {
    let frame = Frame::new(16, 16);
    let lists = [
        [[1.0, 1.0], [5.0, 5.0], [9.0, 9.0]],
        [[1.0, 1.0], [1.0, 1.0], [9.0, 2.0]],
        [[3.0, 3.0]; 3],
        // Less than half a subpixel wide.
        [[1.0, 1.0], [9.0, 1.0], [9.0, 1.001]],
    ];
    for points in lists {
        let positions = points.map(|point| frame.at(point));
        let statistics = Rasterizer::<()>::new(frame.viewport())
            .draw(&mut Nowhere::new(frame.area()), Primitives::list(), &positions, (), |_| ())
            .expect("legal input");
        assert_eq!((statistics.degenerate, statistics.fragments), (1, 0), "{points:?}: {statistics:?}");
    }
}

#[test]
fn frames_of_every_small_and_odd_size() {
    for (width, height) in
        [(1, 1), (1, 2), (1, 50), (50, 1), (7, 13), (13, 7), (63, 65), (65, 3), (257, 2), (2, 300)]
    {
        let frame = Frame::new(width, height);
        // A triangle over everything, and two over half of it each.
        let all = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| Vec4::new(x, y, 0.5, 1.0));
        let halves = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| Vec4::new(x, y, 0.5, 1.0));
        let counts = frame.counts(&[&all[..], &halves].concat());
        frame.assert_all(&counts, "twice", |_, _, count| count == 2);
    }
}

/// `EXTENT` names the coordinates that exist, so all of them can be drawn to.
#[test]
fn the_largest_viewports_are_drawn_to_their_last_pixels() {
    let all = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| Vec4::new(x, y, 0.5, 1.0));
    for (x, y, width, height) in [
        (0.0, 0.0, 16_384.0, 1.0),
        (-16_384.0, 0.0, 16_384.0, 1.0),
        (0.0, 0.0, 1.0, 16_384.0),
        (0.0, -16_384.0, 1.0, 16_384.0),
    ] {
        let viewport = Viewport::new(x, y, width, height).expect("legal");
        let mut target = Nowhere::new(Rect { x: -16_384, y: -16_384, width: 32_768, height: 32_768 });
        let statistics = Rasterizer::<()>::new(viewport)
            .draw(&mut target, Primitives::list(), &all, (), |_| ())
            .expect("legal input");
        assert_eq!(statistics.fragments, 16_384, "{viewport:?}: {statistics:?}");
    }
    // All of it at once, looked at in its corners.
    let viewport = Viewport::new(-16_384.0, -16_384.0, 32_768.0, 32_768.0).expect("legal");
    for (x, y) in [(-16_384, -16_384), (16_380, -16_384), (-16_384, 16_380), (16_380, 16_380)] {
        let area = Rect { x, y, width: 4, height: 4 };
        let drawn = records_of(&Rasterizer::new(viewport), area, &all, &[mixed(0.0, 0.0, 0); 3]);
        assert_eq!(drawn.len(), 16, "{area:?}");
    }
}

#[test]
fn empty_frames_and_rectangles_draw_nothing() {
    let mut nothing: [u8; 0] = [];
    let all = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| Vec4::new(x, y, 0.5, 1.0));
    let rasterizer = Rasterizer::<()>::new(Viewport::of_size(8, 8).expect("legal"));
    for (width, height) in [(0, 0), (0, 8), (8, 0)] {
        let mut target = Surface::color_only(&mut nothing, width, height).expect("nothing is enough");
        let statistics = rasterizer.draw(&mut target, Primitives::list(), &all, (), |_| 1u8).expect("legal");
        assert_eq!((statistics.primitives, statistics.fragments), (1, 0), "{width} × {height}");
    }
    let mut target = Nowhere::new(Rect { x: 100, y: 100, width: 8, height: 8 });
    let statistics = rasterizer.draw(&mut target, Primitives::list(), &all, (), |_| ()).expect("legal");
    assert_eq!(statistics.fragments, 0, "the viewport lies elsewhere");
    let none: [Vec4; 0] = [];
    for topology in [Topology::List, Topology::Strip, Topology::Fan] {
        let primitives = Primitives::new(topology);
        let statistics = rasterizer.draw(&mut target, primitives, &none, (), |_| ()).expect("legal");
        assert_eq!(statistics, Statistics::default(), "no vertices, {topology:?}");
        let no_indices: [u16; 0] = [];
        let statistics =
            rasterizer.draw(&mut target, primitives.indexed(&no_indices), &all, (), |_| ()).expect("legal");
        assert_eq!(statistics, Statistics::default(), "no indices, {topology:?}");
    }
}

#[test]
fn sizes_that_overflow_are_refused() {
    let (mut pixels, mut depths) = ([0u8; 4], [0.0f32; 4]);
    let error = Surface::new(&mut pixels, &mut depths, u32::MAX, u32::MAX).expect_err("out of range");
    assert!(error.to_string().contains("reach out of"), "{error}");
    let error = Surface::with_planes(&mut pixels[..], &mut depths[..], Rect::of_size(2, 3), usize::MAX)
        .expect_err("rows a whole memory apart");
    assert_eq!(error, SurfaceError::TooShort { plane: "color", len: 4, needed: usize::MAX }, "{error}");
    let error = Surface::new(&mut pixels, &mut depths, 16_384, 16_384).expect_err("4 < 2²⁸");
    assert!(error.to_string().contains("the color slice has 4 elements"), "{error}");
    let error = Surface::new(&mut pixels, &mut [0.0f32; 3], 2, 2).expect_err("3 < 4");
    assert_eq!(
        error.to_string(),
        "the depth slice has 3 elements, but the surface needs 4",
        "which, and how many"
    );
    let error = Surface::with_planes(
        &mut pixels[..],
        Absent::default(),
        Rect { x: i32::MIN, y: 0, width: 1, height: 1 },
        1,
    )
    .expect_err("no such column");
    assert!(matches!(error, SurfaceError::OutOfRange { .. }), "{error}");
}

#[test]
fn indices_out_of_range_are_told_before_anything_is_drawn() {
    let frame = Frame::new(16, 16);
    let positions = [[0.0, 0.0], [0.0, 16.0], [16.0, 0.0]].map(|point| frame.at(point));
    let rasterizer = Rasterizer::<()>::new(frame.viewport());
    let mut shaded = 0;
    type Draw<'a> = &'a dyn Fn(&mut Nowhere, &mut dyn FnMut()) -> Result<Statistics, DrawError>;
    let mut draw = |draw: Draw<'_>| {
        draw(&mut Nowhere::new(frame.area()), &mut || shaded += 1).expect_err("an index is out of range")
    };
    let error = draw(&|target, note| {
        rasterizer.draw(target, Primitives::list().indexed(&[0u8, 1, 2, 0, 1, 3]), &positions, (), |_| note())
    });
    assert_eq!(error, DrawError::IndexOutOfRange { position: 5, index: 3, vertices: 3 }, "u8");
    assert_eq!(
        error.to_string(),
        "index 3, at position 5, is out of range: there are 3 vertices",
        "in words"
    );
    let error = draw(&|target, note| {
        rasterizer
            .draw(target, Primitives::strip().indexed(&[0u16, 1, 2, 65_535]), &positions, (), |_| note())
    });
    assert_eq!(
        error,
        DrawError::IndexOutOfRange { position: 3, index: 65_535, vertices: 3 },
        "u16, no restart"
    );
    let error = draw(&|target, note| {
        let primitives = Primitives::fan().indexed(&[0u32, 1, 2, 3_000_000_000, u32::MAX]).with_restart();
        rasterizer.draw(target, primitives, &positions, (), |_| note())
    });
    assert!(matches!(error, DrawError::IndexOutOfRange { position: 3, vertices: 3, .. }), "u32: {error}");
    // An index of a triangle that will never be complete is still wrong.
    let error = draw(&|target, note| {
        rasterizer.draw(target, Primitives::list().indexed(&[0u8, 1, 2, 9]), &positions, (), |_| note())
    });
    assert_eq!(error, DrawError::IndexOutOfRange { position: 3, index: 9, vertices: 3 }, "left over");
    let none: [Vec4; 0] = [];
    let error = draw(&|target, note| {
        rasterizer.draw(target, Primitives::list().indexed(&[0u8, 0, 0]), &none, (), |_| note())
    });
    assert_eq!(error, DrawError::IndexOutOfRange { position: 0, index: 0, vertices: 0 }, "no vertices");
    assert_eq!(shaded, 0, "nothing was drawn");
}

fn unreachable_color() {
    panic!("nothing is drawn");
}

#[test]
fn too_few_values_and_too_little_room_are_told() {
    let frame = Frame::new(16, 16);
    let positions = [[0.0, 0.0], [0.0, 16.0], [16.0, 0.0]].map(|point| frame.at(point));
    let rasterizer = Rasterizer::<f32>::new(frame.viewport());
    let mut target = Nowhere::new(frame.area());
    let error = rasterizer
        .draw(&mut target, Primitives::list(), &positions, &[1.0f32, 2.0][..], |_| unreachable_color())
        .expect_err("2 < 3");
    assert_eq!(error, DrawError::TooFewVaryings { positions: 3, varyings: 2 }, "{error}");
    let mut room = [ProjectedVertex::default(); 2];
    let error = rasterizer.project(&positions, &mut room).expect_err("2 < 3");
    assert_eq!(error, DrawError::TooFewProjected { positions: 3, room: 2 }, "{error}");
    let error = rasterizer.project(Attribute::constant(&Vec4::W), &mut room).expect_err("no end");
    assert!(matches!(error, DrawError::TooFewProjected { room: 2, .. }), "{error}");
}

#[test]
fn endless_positions_need_indices() {
    let frame = Frame::new(16, 16);
    let rasterizer = Rasterizer::<()>::new(frame.viewport());
    let mut target = Nowhere::new(frame.area());
    let everywhere = Vec4::new(0.0, 0.0, 0.5, 1.0);
    for topology in [Topology::List, Topology::Strip, Topology::Fan] {
        let error = rasterizer
            .draw(&mut target, Primitives::new(topology), Attribute::constant(&everywhere), (), |_| ())
            .expect_err("it would never end");
        assert_eq!(error, DrawError::Endless, "{topology:?}");
    }
    let indices = [0u32, 1, 1_000_000_000];
    let statistics = rasterizer
        .draw(&mut target, Primitives::list().indexed(&indices), Attribute::constant(&everywhere), (), |_| ())
        .expect("three times the same point");
    assert_eq!((statistics.primitives, statistics.degenerate), (1, 1), "{statistics:?}");
    // Endless values for positions that end are what constants are for.
    let positions = [[0.0, 0.0], [0.0, 16.0], [16.0, 0.0]].map(|point| frame.at(point));
    let rasterizer = Rasterizer::<f32>::new(frame.viewport());
    let drawn =
        rasterizer.draw(&mut target, Primitives::list(), &positions, Attribute::constant(&1.0), |_| ());
    assert_eq!(drawn.expect("legal").fragments, 120, "a constant");
}

#[test]
fn strides_and_lengths_of_attributes_do_not_overflow() {
    let elements = [1.0f32, 2.0, 3.0];
    let huge = Attribute::slice(&elements).with_stride(usize::MAX);
    assert_eq!(
        (huge.len(), huge.fetch(0), huge.fetch(1), huge.fetch(usize::MAX)),
        (1, Some(1.0), None, None),
        "stride"
    );
    let none: [f32; 0] = [];
    for stride in [0, 1, 2, usize::MAX] {
        let empty = Attribute::slice(&none).with_stride(stride);
        assert_eq!((empty.len(), empty.fetch(0)), (0, None), "stride {stride}");
    }
    assert_eq!(Computed::new(3, |i| i).fetch(3), None, "past the end");
    assert_eq!((&elements[..], Attribute::constant(&5u8)).len(), 3, "the shortest");
}

/// A framebuffer that breaks its law: it lends other lengths than were asked for.
struct Liar {
    color: Vec<u32>,
    depth: Vec<f32>,
    /// How many more or fewer.
    color_more: i32,
    depth_more: i32,
    area: Rect,
}

impl Liar {
    fn new(color_more: i32, depth_more: i32, area: Rect) -> Self {
        Self { color: vec![0; 400], depth: vec![1.0; 400], color_more, depth_more, area }
    }
}

impl Framebuffer for Liar {
    type Color = u32;
    type Depth = f32;

    fn area(&self) -> Rect {
        self.area
    }

    fn run(&mut self, _: i32, _: i32, len: usize) -> Run<'_, u32, f32> {
        let more = |more: i32| {
            i32::try_from(len).expect("short").saturating_add(more).max(0).unsigned_abs() as usize
        };
        let (color, depth) = (more(self.color_more), more(self.depth_more));
        self.depth.fill(1.0); // every row is the same memory
        Run { color: &mut self.color[..color], depth: &mut self.depth[..depth] }
    }
}

#[test]
fn framebuffers_that_lend_too_little_are_drawn_no_farther_than_they_go() {
    let frame = Frame::new(16, 16);
    let all = [[-16.0, -16.0], [-16.0, 64.0], [64.0, -16.0]].map(|point| frame.at(point));
    let area = frame.area();
    for (color, depth) in [(-1, -1), (-1, 0), (0, -1), (-15, -3), (-16, 0), (0, -16), (-99, -99)] {
        let mut target = Liar::new(color, depth, area);
        let statistics = Rasterizer::<()>::new(frame.viewport())
            .with_depth_test(halfplane::Always)
            .draw(&mut target, Primitives::list(), &all, (), |fragment| {
                assert!(area.contains(fragment.x(), fragment.y()), "{fragment:?}");
                1u32
            })
            .expect("legal input");
        let drawn = u64::from((16 + color.min(depth)).max(0).unsigned_abs());
        assert!(statistics.fragments <= 16 * drawn, "{color} {depth}: {statistics:?}");
    }
}

/// 100 × 30 pixels, of which 70 columns are there; it says that there are 2³² − 1, from −64 on.
struct Miser {
    color: Vec<u32>,
    depth: Vec<f32>,
}

impl Framebuffer for Miser {
    type Color = u32;
    type Depth = f32;

    fn area(&self) -> Rect {
        Rect { x: -64, y: 0, width: u32::MAX, height: 30 }
    }

    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u32, f32> {
        let at = |x: i32| x.clamp(0, 70).unsigned_abs() as usize + 70 * y.unsigned_abs() as usize;
        let (start, end) = (at(x), at(x.saturating_add(i32::try_from(len).expect("short"))));
        Run { color: &mut self.color[start..end], depth: &mut self.depth[start..end] }
    }
}

#[test]
fn what_is_lent_of_a_row_is_drawn_whatever_else_is_hidden() {
    let frame = Frame::new(100, 30);
    let all = [[-1.0, -1.0], [-1.0, 300.0], [300.0, -1.0]].map(|point| frame.at(point));
    for hidden in [None, Some(0usize), Some(33), Some(69)] {
        let mut depth = vec![1.0; 70 * 30];
        for row in depth.chunks_exact_mut(70) {
            if let Some(x) = hidden {
                row[x] = 0.0;
            }
        }
        let mut target = Miser { color: vec![0; 70 * 30], depth };
        let rasterizer = Rasterizer::<()>::new(frame.viewport());
        let statistics = rasterizer.draw(&mut target, Primitives::list(), &all, (), |_| 1u32).expect("legal");
        let expected = 30 * (70 - u64::from(hidden.is_some()));
        assert_eq!(statistics.samples_passed, expected, "{hidden:?}");
        assert_eq!(target.color.iter().filter(|&&color| color == 1).count() as u64, expected, "{hidden:?}");
    }
    // A tiny one, farther from the right border than an i32 tells.
    let mut target = Miser { color: vec![0; 70 * 30], depth: vec![1.0; 70 * 30] };
    let tiny = [[27.0, 1.0], [27.0, 6.0], [31.0, 1.0]].map(|point| frame.at(point));
    let rasterizer = Rasterizer::<()>::new(Viewport::new(-64.0, 0.0, 164.0, 30.0).expect("legal"));
    rasterizer.draw(&mut target, Primitives::list(), tiny, (), |_| 1u32).expect("legal");
    rasterizer.draw_depth(&mut target, Primitives::list(), tiny).expect("legal");
    // A tiny one across the end of what is there: columns 66 to 73, of which 70 and on are not.
    let mut target = Miser { color: vec![0; 70 * 30], depth: vec![1.0; 70 * 30] };
    let tiny = [[66.0, 1.0], [66.0, 9.0], [74.0, 1.0]].map(|point| frame.at(point));
    let always = Rasterizer::<()>::new(frame.viewport()).with_depth_test(halfplane::Always);
    let statistics = always.draw(&mut target, Primitives::list(), tiny, (), |_| 1u32).expect("legal");
    assert_eq!(
        statistics.fragments,
        4 + 4 + 4 + 4 + 3 + 2 + 1,
        "seven samples in the first row, of which four are there"
    );
    assert_eq!(target.color.iter().sum::<u32>(), 22, "each in its place");
}

/// Found by this file: what is beyond the run was asked for by nobody.
#[test]
fn framebuffers_that_lend_too_much_are_drawn_no_farther_than_the_triangle() {
    let frame = Frame::new(16, 16);
    let all = [[-16.0, -16.0], [-16.0, 64.0], [64.0, -16.0]].map(|point| frame.at(point));
    for (color, depth) in [(5, 5), (300, 300), (0, 7), (7, 0)] {
        let mut target = Liar::new(color, depth, frame.area());
        let statistics = Rasterizer::<()>::new(frame.viewport())
            .with_depth_test(halfplane::Always)
            .draw(&mut target, Primitives::list(), &all, (), |fragment| {
                assert!(fragment.x() < 16, "{} lies outside", fragment.x());
                1u32
            })
            .expect("legal input");
        assert_eq!(statistics.fragments, 256, "{color} {depth}: {statistics:?}");
    }
}

/// Found in a review: pixels that were lent beyond the request were written to, if the closure held something. And those of
/// a framebuffer that lends half of every request were drawn, or not, by what the closure held.
#[test]
fn what_is_lent_is_drawn_alike_whatever_the_closure_holds() {
    /// Lends half of what it is asked for, or the rest of the row.
    struct Whim {
        color: Vec<u32>,
        depth: Vec<f32>,
        lends_half: bool,
    }
    impl Framebuffer for Whim {
        type Color = u32;
        type Depth = f32;
        fn area(&self) -> Rect {
            Rect::of_size(128, 16)
        }
        fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u32, f32> {
            let (x, y) = (x.unsigned_abs() as usize, y.unsigned_abs() as usize);
            let end = if self.lends_half { x + len.div_ceil(2) } else { 128 };
            let place = 128 * y + x..128 * y + end;
            Run { color: &mut self.color[place.clone()], depth: &mut self.depth[place] }
        }
    }
    let frame = Frame::new(128, 16);
    let half = [[0.0, 0.0], [0.0, 16.0], [128.0, 0.0]].map(|point| frame.at(point));
    let rasterizer = Rasterizer::<()>::new(frame.viewport());
    for lends_half in [false, true] {
        let empty = || Whim { color: vec![0; 128 * 16], depth: vec![1.0; 128 * 16], lends_half };
        let (mut one, mut other, mut third) = (empty(), empty(), empty());
        let of_none = rasterizer.draw(&mut one, Primitives::list(), half, (), |_| 7u32);
        let held = core::hint::black_box(7u32);
        let of_some = rasterizer.draw(&mut other, Primitives::list(), half, (), |_| held);
        let nothing =
            rasterizer.draw(&mut third, Primitives::list(), half, (), |_| (held == 0).then_some(held));
        let drawn = one.color.iter().filter(|&&color| color == 7).count();
        assert!(one.color == other.color && one.depth == other.depth, "pixels, {lends_half}");
        assert_eq!(of_none.expect("legal").samples_passed, drawn as u64, "{lends_half}");
        assert_eq!(of_some.expect("legal").samples_passed, drawn as u64, "{lends_half}");
        assert_eq!(nothing.expect("legal").samples_passed, 0, "all discarded");
        assert!(third.depth.iter().all(|&depth| depth == 1.0), "{lends_half}");
        assert!(if lends_half { drawn > 0 } else { drawn == 128 * 16 / 2 }, "{drawn}");
    }
}

/// Found by this file, together with a loop without end: depths without a colour do not count, and do not let others pass.
#[test]
fn framebuffers_with_more_depths_than_colours_draw_what_passes() {
    struct Uneven([u32; 1], [f32; 2]);
    impl Framebuffer for Uneven {
        type Color = u32;
        type Depth = f32;
        fn area(&self) -> Rect {
            Rect::of_size(2, 1)
        }
        fn run(&mut self, x: i32, _: i32, len: usize) -> Run<'_, u32, f32> {
            let x = x.unsigned_abs() as usize;
            Run { color: &mut self.0[x..], depth: &mut self.1[x..x + len] }
        }
    }
    let frame = Frame::new(2, 1);
    let all = [[-16.0, -16.0], [-16.0, 64.0], [64.0, -16.0]].map(|point| frame.at(point));
    let mut target = Uneven([7], [0.0, 1.0]);
    let rasterizer = Rasterizer::<()>::new(frame.viewport()).with_depth_test(Less);
    let statistics =
        rasterizer.draw(&mut target, Primitives::list(), &all, (), |_| 1u32).expect("legal input");
    assert_eq!((target.0, statistics.fragments), ([7], 0), "depth 0 lets nothing pass");
}

#[test]
fn framebuffers_that_lend_other_than_asked_are_prefetched_as_far_as_they_go() {
    let frame = Frame::new(16, 16);
    let rasterizer = Rasterizer::<()>::new(frame.viewport());
    for (color, depth) in [(0, 0), (-1, 0), (0, -1), (-99, -99), (300, 0), (0, 300)] {
        let mut target = Liar::new(color, depth, frame.area());
        rasterizer.prefetch(&mut target);
        assert!(target.color == [0; 400] && target.depth == [1.0; 400], "only read: {color} {depth}");
    }
    let mut miser = Miser { color: vec![0; 70 * 30], depth: vec![1.0; 70 * 30] };
    Rasterizer::<()>::new(Frame::new(100, 30).viewport()).prefetch(&mut miser);
    rasterizer.prefetch(&mut Surface::new(&mut [0u8; 0][..], &mut [0u16; 0][..], 0, 9).expect("nothing"));
    for at in [i32::MIN, i32::MAX] {
        rasterizer.prefetch(&mut Nowhere::new(Rect { x: at, y: at, width: u32::MAX, height: u32::MAX }));
    }
    rasterizer.prefetch(&mut Nowhere::new(frame.area()));
}

#[test]
fn framebuffers_of_any_area_are_asked_only_for_what_exists() {
    let frame = Frame::new(16, 16);
    let all = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| Vec4::new(x, y, 0.5, 1.0));
    for area in [
        Rect { x: i32::MIN, y: i32::MIN, width: u32::MAX, height: u32::MAX },
        Rect { x: i32::MAX, y: i32::MAX, width: u32::MAX, height: u32::MAX },
        Rect { x: -5, y: -5, width: u32::MAX, height: 10 },
    ] {
        let statistics = Rasterizer::<()>::new(frame.viewport())
            .draw(&mut Liar::new(0, 0, area), Primitives::list(), &all, (), |fragment| {
                assert!(frame.area().contains(fragment.x(), fragment.y()), "{fragment:?}");
                1u32
            })
            .expect("legal input");
        assert_eq!(
            statistics.fragments,
            u64::from(area.intersection(frame.area()).width * area.intersection(frame.area()).height),
            "{area:?}"
        );
    }
}

#[test]
fn projected_vertices_are_checked() {
    for (x, y, depth, inv_w, is_valid) in [
        (0, 0, 0.5, 1.0, true),
        (16_384 * 256, -16_384 * 256, -3.0, f32::MIN_POSITIVE, true),
        (16_384 * 256 + 1, 0, 0.5, 1.0, false),
        (i32::MIN, 0, 0.5, 1.0, false),
        (0, i32::MAX, 0.5, 1.0, false),
        (0, 0, f32::NAN, 1.0, false),
        (0, 0, -2f32.powi(40), 1.0, true),
        (0, 0, 2f32.powi(41), 1.0, false),
        (0, 0, f32::INFINITY, 1.0, false),
        (0, 0, 0.5, f32::MIN_POSITIVE, true),
        (0, 0, 0.5, 2f32.powi(64), true),
        (0, 0, 0.5, 2f32.powi(65), false),
        (0, 0, 0.5, 0.0, false),
        (0, 0, 0.5, -1.0, false),
        (0, 0, 0.5, 1e-45, false),
        (0, 0, 0.5, f32::INFINITY, false),
    ] {
        let vertex = ProjectedVertex::new(x, y, depth, inv_w);
        assert_eq!(vertex.is_some(), is_valid, "({x}, {y}), {depth}, {inv_w}");
    }
    let m = 16_384 * 256;
    let vertex = |x, y| ProjectedVertex::new(x, y, 0.5, 2f32.powi(64)).expect("legal");
    let setup = Setup::new([vertex(-m, -m), vertex(-m, m), vertex(m, -m)]).expect("an area");
    let mut spans = 0;
    setup.for_each_span(Rect { x: i32::MIN, y: -3, width: u32::MAX, height: 6 }, |span| {
        assert_eq!(span.start(), -16_384, "from the first column");
        assert_eq!(span.end(), -span.y() - 1, "to the diagonal, whose samples it gives away");
        spans += 1;
    });
    assert_eq!(spans, 6, "every row");
    assert_eq!(Setup::new([ProjectedVertex::default(); 3]).map(|_| ()), None, "no area");
}

#[test]
fn random_bits_as_vertices() {
    let random = &mut Random::new(3);
    let frame = Frame::new(9, 7);
    let mut rasterizer = Rasterizer::<()>::new(frame.viewport());
    for _ in 0..effort(500) {
        let mut number = || f32::from_bits(u32::try_from(random.bits() >> 32).expect("32 bits"));
        let positions: Vec<Vec4> =
            (0..12).map(|_| Vec4::new(number(), number(), number(), number())).collect();
        for depth_clip in [DepthClip::Clip, DepthClip::Clamp] {
            rasterizer.depth_clip = depth_clip;
            let statistics = rasterizer
                .draw(&mut Nowhere::new(frame.area()), Primitives::list(), &positions[..], (), |_| ())
                .expect("legal input");
            assert_sound(statistics, 4);
        }
    }
}

/// Lends exactly what it is asked for, and minds if that is not there: the framebuffer of the docs.
struct Strict {
    color: Vec<u32>,
    depth: Vec<f32>,
    lends_blocks: bool,
}

impl Strict {
    const SIZE: u32 = 64;

    fn new(lends_blocks: bool) -> Self {
        Self { color: vec![0; 64 * 64], depth: vec![1.0; 64 * 64], lends_blocks }
    }
}

impl Framebuffer for Strict {
    type Color = u32;
    type Depth = f32;

    fn area(&self) -> Rect {
        Rect::of_size(Self::SIZE, Self::SIZE)
    }

    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u32, f32> {
        let [x, y] = [x, y].map(|at| usize::try_from(at).expect("inside"));
        assert!(x + len <= 64 && y < 64, "{len} pixels from ({x}, {y})");
        let place = 64 * y + x..64 * y + x + len;
        Run { color: &mut self.color[place.clone()], depth: &mut self.depth[place] }
    }

    fn block(&mut self, x: i32, y: i32, width: usize, height: usize) -> Option<Block<'_, u32, f32>> {
        let [x, y] = [x, y].map(|at| usize::try_from(at).expect("inside"));
        assert!(width > 0 && x + width <= 64, "{width} pixels from column {x}");
        assert!(height > 0 && y + height <= 64, "{height} rows from {y}");
        assert!(width <= 512 && height <= 32, "no larger than documented: {width} by {height}");
        let place = 64 * y + x..64 * (y + height - 1) + x + width;
        let (color, depth) = (&mut self.color[place.clone()], &mut self.depth[place]);
        self.lends_blocks.then_some(Block { color, depth, stride: 64 })
    }
}

/// Lends blocks that are too short, by so many colours and depths, or says that they have another stride.
struct Scant {
    whole: Strict,
    color_less: usize,
    depth_less: usize,
    stride: usize,
}

impl Framebuffer for Scant {
    type Color = u32;
    type Depth = f32;

    fn area(&self) -> Rect {
        self.whole.area()
    }

    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u32, f32> {
        self.whole.run(x, y, len)
    }

    fn block(&mut self, x: i32, y: i32, width: usize, height: usize) -> Option<Block<'_, u32, f32>> {
        let Block { color, depth, .. } = self.whole.block(x, y, width, height)?;
        let (color_len, depth_len) = (color.len(), depth.len());
        Some(Block {
            color: &mut color[..color_len.saturating_sub(self.color_less)],
            depth: &mut depth[..depth_len.saturating_sub(self.depth_less)],
            stride: self.stride,
        })
    }
}

#[test]
fn of_blocks_that_are_too_short_runs_are_drawn() {
    let frame = Frame::new(64, 64);
    let (rasterizer, mut random) = (Rasterizer::<()>::new(frame.viewport()), Random::new(2));
    let positions: Vec<_> = (0..300)
        .flat_map(|_| {
            let (x, y) = (64.0 * random.unit(), 64.0 * random.unit());
            [(); 3].map(|()| frame.at([x + 9.0 * random.unit(), y + 9.0 * random.unit()]))
        })
        .collect();
    let (positions, mut whole) = (&positions[..], Strict::new(true));
    let all = rasterizer.draw(&mut whole, Primitives::list(), positions, (), |_| 1).expect("legal");
    let scant = |color_less, depth_less, stride| {
        let mut target = Scant { whole: Strict::new(true), color_less, depth_less, stride };
        let drawn = rasterizer.draw(&mut target, Primitives::list(), positions, (), |_| 1).expect("legal");
        let color = target.whole.color;
        let mut target = Scant { whole: Strict::new(true), color_less, depth_less, stride };
        rasterizer.draw_depth(&mut target, Primitives::list(), positions).expect("legal");
        (drawn, color, target.whole.depth)
    };
    for (color_less, depth_less) in [(1, 0), (0, 1), (100, 100), (0, 5000), (5000, 0), (5000, 5000)] {
        let (drawn, color, depth) = scant(color_less, depth_less, 64);
        assert_eq!(drawn, all, "{color_less} colours and {depth_less} depths less");
        assert!(color == whole.color && depth == whole.depth, "what a block lacks, runs have");
    }
    for stride in [0, 1, 65, usize::MAX, usize::MAX - 3, usize::MAX / 2, usize::MAX / 3] {
        scant(0, 0, stride); // without a panic
    }
}

#[test]
fn no_pixel_outside_of_the_framebuffer_is_asked_for() {
    let frame = Frame::new(64, 64);
    let rasterizer = Rasterizer::<()>::new(frame.viewport());
    // Its last row in the frame begins right of it.
    let steep = [[14.0, 61.0], [254.0, 67.0], [34.0, 61.0]].map(|point| frame.at(point));
    let mut random = Random::new(1);
    let mut others = Vec::new();
    for size in [1.0, 3.0, 12.0, 90.0, 400.0] {
        for _ in 0..600 {
            let mut at = |around: f32| around + size * (random.unit() - 0.5);
            let (x, y) = (at(32.0) * 1.2, at(32.0) * 1.2);
            others.extend([(); 3].map(|()| frame.at([at(x), at(y)])));
        }
    }
    // Neighbours across each border and corner.
    for [x, y] in
        [[0.0, 0.0], [30.0, 0.0], [64.0, 0.0], [64.0, 30.0], [64.0, 64.0], [30.0, 64.0], [0.0, 64.0]]
    {
        for _ in 0..64 {
            let mut at = |around: f32| around + 8.0 * (random.unit() - 0.5);
            others.extend([(); 3].map(|()| frame.at([at(x), at(y)])));
        }
    }
    for (positions, lends_blocks) in [(&steep[..], false), (&steep, true), (&others, false), (&others, true)]
    {
        let mut target = Strict::new(lends_blocks);
        let checker = |fragment: Fragment<'_, ()>| ((fragment.x() ^ fragment.y()) & 1 == 0).then_some(1);
        let drawn = rasterizer.draw(&mut target, Primitives::list(), positions, (), checker);
        assert!(drawn.is_ok_and(|statistics| statistics.samples_passed > 0), "some are kept");
        let drawn = rasterizer.draw_depth(&mut Strict::new(lends_blocks), Primitives::list(), positions);
        assert!(drawn.is_ok_and(|statistics| statistics.samples_passed > 0), "depth");
    }
}

#[test]
fn positions_that_change_are_not_drawn_outside_of_the_framebuffer() {
    let frame = Frame::new(64, 64);
    let rasterizer = Rasterizer::<()>::new(frame.viewport());
    let triangles = |size: f32| -> Vec<_> {
        (0..64u8)
            .flat_map(|i| {
                let (x, y) = (f32::from(i % 8) * 8.0 + 0.3, f32::from(i / 8) * 8.0 + 0.3);
                [[x, y], [x, y + size], [x + size, y]].map(|point| frame.at(point))
            })
            .collect()
    };
    // Smaller than two pixels, and as wide as a narrow window.
    let sizes = [(1.5, false), (1.5, true), (7.5, false), (7.5, true)];
    for (scale, (size, lends_blocks)) in
        [1.03, 1.5, 40.0, -1.0].map(|scale| sizes.map(|size| (scale, size))).concat()
    {
        let small = triangles(size);
        // Asked for the first time, every one is inside.
        let asked = Cell::new(0);
        let changing = Computed::new(small.len(), |i| {
            asked.set(asked.get() + 1);
            let [x, y, z, w] = small[i].to_array();
            if asked.get() <= small.len() { small[i] } else { Vec4::new(x * scale, y * scale, z, w) }
        });
        let drawn = rasterizer.draw(&mut Strict::new(lends_blocks), Primitives::list(), &changing, (), |_| 1);
        assert!(drawn.is_ok() && (asked.get() > small.len() || !HAS_SIMD), "asked twice: {scale}");
        asked.set(0);
        let drawn = rasterizer.draw_depth(&mut Strict::new(lends_blocks), Primitives::list(), changing);
        assert!(drawn.is_ok(), "{scale}");
        // Or then one of its vertices is so far away that it should have been clipped.
        asked.set(0);
        let leaving = Computed::new(small.len(), |i| {
            asked.set(asked.get() + 1);
            if asked.get() <= small.len() || i % 3 < 2 {
                small[i]
            } else {
                Vec4::new(1e6 * scale, 0.0, 0.5, 1.0)
            }
        });
        let drawn = rasterizer.draw(&mut Strict::new(lends_blocks), Primitives::list(), &leaving, (), |_| 1);
        assert!(drawn.is_ok() && (asked.get() > small.len() || !HAS_SIMD), "asked twice: {scale}");
        asked.set(0);
        let drawn = rasterizer.draw_depth(&mut Strict::new(lends_blocks), Primitives::list(), leaving);
        assert!(drawn.is_ok(), "{scale}");
        // Or all of them, behind the eye; but for some triangles, so that nobody looks whether all are hidden.
        asked.set(0);
        let gone = Computed::new(small.len(), |i| {
            asked.set(asked.get() + 1);
            if asked.get() <= small.len() || i < 9 { small[i] } else { Vec4::new(scale, 0.0, 0.5, -1.0) }
        });
        let drawn = rasterizer.draw(&mut Strict::new(lends_blocks), Primitives::list(), &gone, (), |_| 1);
        assert!(drawn.is_ok() && (asked.get() > small.len() || !HAS_SIMD), "asked twice: {scale}");
        asked.set(0);
        let drawn = rasterizer.draw_depth(&mut Strict::new(lends_blocks), Primitives::list(), gone);
        assert!(drawn.is_ok(), "{scale}");
    }
}

#[test]
fn indices_that_change_are_not_drawn_outside_of_the_framebuffer() {
    /// Looked through, all its indices are in range.
    struct Changing {
        checked: Vec<u32>,
        then: Vec<u32>,
        asked: Cell<bool>,
    }
    impl AsRef<[u32]> for Changing {
        fn as_ref(&self) -> &[u32] {
            if self.asked.replace(true) { &self.then } else { &self.checked }
        }
    }
    let frame = Frame::new(64, 64);
    let rasterizer = Rasterizer::<()>::new(frame.viewport());
    let minute = [[0.1, 1.7], [1.9, 0.2], [0.1, 0.2]];
    for far in [Vec4::new(0.1, 0.2, 0.5, -1.0), frame.at([-990.0, 900.0])] {
        let positions = [frame.at(minute[0]), frame.at(minute[1]), frame.at(minute[2]), far];
        let mut room = [ProjectedVertex::BLANK; 4];
        let projected = rasterizer.project(&positions, &mut room).expect("enough");
        for wrong in [[1_000_000, 3, 1], [3, 1_000_000, 0], [3, 3, 1_000_000], [3, 0, 1_000_000]] {
            // As many of each as are looked at together: where the wrong ones stand, there were others before.
            let then = [[0, 1, 2].repeat(64), wrong.repeat(64)].concat();
            let changing = Changing { checked: vec![0; then.len()], then, asked: Cell::new(false) };
            let indices = IndexBuffer::new(changing);
            let primitives = Primitives::list().indexed_by(&indices);
            for lends_blocks in [false, true] {
                let mut target = Strict::new(lends_blocks);
                let drawn = rasterizer.draw(&mut target, primitives, projected, (), |_| 1);
                assert!(drawn.is_ok_and(|statistics| statistics.samples_passed > 0), "{wrong:?}");
                let drawn = rasterizer.draw_depth(&mut Strict::new(lends_blocks), primitives, projected);
                assert!(drawn.is_ok_and(|statistics| statistics.samples_passed > 0), "{wrong:?}");
            }
        }
    }
}

#[test]
fn what_overflows_does_not_fit_even_where_nothing_is_stored() {
    let area = Rect::of_size(40, 17);
    let absent = |stride| Surface::with_planes(Absent::default(), Absent::default(), area, stride).map(drop);
    assert_eq!(absent(usize::MAX / 17), Ok(()), "just fits");
    let error = SurfaceError::TooShort { plane: "color", len: usize::MAX, needed: usize::MAX };
    assert_eq!(absent(usize::MAX / 16), Err(error), "16 rows and 40 pixels");
    assert_eq!(absent(usize::MAX / 2), Err(error), "more by far");
}

type DepthOnly<'a> = Surface<Absent, &'a mut [f32]>;

#[test]
fn planes_that_are_absent_are_as_large_as_any_frame() {
    for width in [64, 2048, 4096, 16_384] {
        let frame = Frame::new(width, 32);
        let rasterizer = Rasterizer::<()>::new(frame.viewport());
        let slice: Vec<_> = [[3.25, 2.0], [3.5, 17.75], [18.75, 17.25]].map(|point| frame.at(point)).into();
        let mut counts = vec![3u8; frame.len()];
        let mut target = Surface::color_only(&mut counts, width, 32).expect("it fits");
        let drawn = rasterizer
            .draw_over(&mut target, Primitives::list(), &slice[..], (), |_, count| count + 1)
            .expect("legal");
        assert_eq!(drawn.samples_passed, 128, "{width}");
        assert_eq!(counts.iter().filter(|&&count| count == 4).count(), 128, "colours of {width}");

        let draw_depth = |draws: &dyn Fn(&mut DepthOnly<'_>) -> u64| {
            let mut depths = vec![1.0f32; frame.len()];
            let samples = draws(&mut Surface::depth_only(&mut depths, width, 32).expect("it fits"));
            assert_eq!(samples, 128, "{width}");
            assert_eq!(depths.iter().filter(|&&depth| depth < 1.0).count(), 128, "depths of {width}");
        };
        draw_depth(&|target| {
            rasterizer.draw_depth(target, Primitives::list(), &slice[..]).expect("legal").samples_passed
        });
        draw_depth(&|target| {
            let drawn = rasterizer.draw(target, Primitives::list(), &slice[..], (), |_| ());
            drawn.expect("legal").samples_passed
        });
    }
}
