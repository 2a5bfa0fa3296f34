//! The picture does not depend on how it was cut, nor on how the same thing was said: every number that a fragment tells
//! is compared bit by bit.

mod common;

use common::{Frame, Mixed, Nowhere, Random, Record, config, mixed, records, records_of};
use glam::Vec4;
use halfplane::{
    Attribute, Computed, Flat, Fragment, Framebuffer, IndexBuffer, NoPerspective, Primitives,
    ProjectedVertex, Rasterizer, Rect, Run, Surface, Viewport,
};
use proptest::prelude::*;

const FRAME: Frame = Frame::new(48, 40);

fn scene(seed: u64) -> (Vec<Vec4>, Vec<Mixed>) {
    FRAME.triangles(&mut Random::new(seed))
}

/// Lends no blocks.
struct InRuns<F>(F);

impl<F: Framebuffer> Framebuffer for InRuns<F> {
    type Color = F::Color;
    type Depth = F::Depth;

    fn area(&self) -> Rect {
        self.0.area()
    }

    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, F::Color, F::Depth> {
        self.0.run(x, y, len)
    }
}

/// The records of a scene by triangle, then by place.
fn sorted(mut records: Vec<Record>) -> Vec<Record> {
    records.sort_unstable();
    records
}

fn rasterizer() -> Rasterizer<Mixed> {
    Rasterizer::new(FRAME.viewport())
}

/// Cuts a rectangle into random smaller ones.
fn tiles(rect: Rect, random: &mut Random) -> Vec<Rect> {
    let Rect { x, y, width, height } = rect;
    let cut = |size: u32, random: &mut Random| {
        random.between(1, i32::try_from(size).expect("small") - 1).unsigned_abs()
    };
    match random.between(0, 5) {
        0 => vec![rect],
        n if n % 2 == 0 && width > 1 => {
            let left = cut(width, random);
            let right = Rect { x: x.saturating_add_unsigned(left), width: width - left, ..rect };
            [tiles(Rect { width: left, ..rect }, random), tiles(right, random)].concat()
        }
        _ if height > 1 => {
            let top = cut(height, random);
            let below = Rect { y: y.saturating_add_unsigned(top), height: height - top, ..rect };
            [tiles(Rect { height: top, ..rect }, random), tiles(below, random)].concat()
        }
        _ => vec![rect],
    }
}

proptest! {
    #![proptest_config(config(100))]

    /// Tiles of any size, in any order, each with coordinates of the frame.
    #[test]
    fn picture_does_not_depend_on_how_the_frame_is_cut_into_tiles(seed in any::<u64>()) {
        let (positions, values) = scene(seed);
        let random = &mut Random::new(!seed);
        let whole = records_of(&rasterizer(), FRAME.area(), &positions, &values);
        let mut tiles = tiles(FRAME.area(), random);
        random.shuffle(&mut tiles);
        let parts = tiles.iter().flat_map(|&tile| records_of(&rasterizer(), tile, &positions, &values)).collect();
        prop_assert_eq!(sorted(whole), sorted(parts), "{:?}", tiles);
    }

    /// The same tiles as scissors on the whole frame, and single pixels.
    #[test]
    fn picture_does_not_depend_on_scissors(seed in any::<u64>()) {
        let (positions, values) = scene(seed);
        let whole = records_of(&rasterizer(), FRAME.area(), &positions, &values);
        let cut_out = |scissor| {
            let mut rasterizer = rasterizer();
            rasterizer.scissor = Some(scissor);
            records_of(&rasterizer, FRAME.area(), &positions, &values)
        };
        let parts = tiles(FRAME.area(), &mut Random::new(!seed)).into_iter().flat_map(cut_out).collect();
        for record in whole.iter().step_by(whole.len() / 5 + 1) {
            let at: Vec<Record> =
                whole.iter().filter(|other| (other.x, other.y) == (record.x, record.y)).copied().collect();
            prop_assert_eq!(cut_out(Rect { x: record.x, y: record.y, width: 1, height: 1 }), at, "one pixel");
        }
        prop_assert_eq!(sorted(whole), sorted(parts), "scissors");
    }

    /// Colour and depth memory after drawing bands, as threads would, with other strides, and with a frame around it.
    #[test]
    fn memory_is_the_same_from_bands_strides_and_larger_frames(seed in any::<u64>(), rows in 1u32..50) {
        let (positions, values) = scene(seed);
        let draw = |target: &mut Surface<&mut [u32], &mut [f32]>| {
            rasterizer()
                .draw(target, Primitives::list(), &positions[..], &values[..], |fragment| {
                    let ([u, v], NoPerspective(n), Flat(flat)) = fragment.varyings();
                    u.to_bits() ^ v.to_bits().rotate_left(8) ^ n.to_bits().rotate_left(16) ^ flat
                })
                .expect("legal input")
        };
        let (mut color, mut depth) = (vec![7u32; FRAME.len()], vec![1.0f32; FRAME.len()]);
        draw(&mut Surface::new(&mut color, &mut depth, FRAME.width, FRAME.height).expect("it fits"));

        let (mut band_color, mut band_depth) = (vec![7u32; FRAME.len()], vec![1.0f32; FRAME.len()]);
        let whole = Surface::new(&mut band_color, &mut band_depth, FRAME.width, FRAME.height).expect("it fits");
        let mut samples = 0;
        for mut band in whole.bands(rows) {
            samples += draw(&mut band).samples_passed;
        }
        prop_assert_eq!((&color, &depth), (&band_color, &band_depth), "bands of {}", rows);
        prop_assert!(samples > 0 || color.iter().all(|&c| c == 7), "statistics");

        // Two pixels more on each side, and five of padding, none of which may change.
        let (stride, area) = (48 + 4 + 5, Rect { x: -2, y: -2, width: 52, height: 44 });
        let (mut wide_color, mut wide_depth) = (vec![7u32; stride * 44], vec![1.0f32; stride * 44]);
        let wide = Surface::with_planes(&mut wide_color[..], &mut wide_depth[..], area, stride);
        draw(&mut wide.expect("it fits"));
        for (i, (&color_here, &depth_here)) in wide_color.iter().zip(&wide_depth).enumerate() {
            let (x, y) = ((i % stride).wrapping_sub(2), (i / stride).wrapping_sub(2));
            let (expected_color, expected_depth) =
                if x < 48 && y < 40 { (color[y * 48 + x], depth[y * 48 + x]) } else { (7, 1.0) };
            prop_assert_eq!((color_here, depth_here), (expected_color, expected_depth), "({}, {})", x, y);
        }
    }

    /// A framebuffer whose rows are one after the other may lend blocks or not. With a scissor or without; nothing outside of it
    /// changes.
    #[test]
    fn memory_is_the_same_in_blocks_and_in_runs(
        seed in any::<u64>(), width in 1u32..24, height in 1u32..24, padding in 0usize..3
    ) {
        let random = &mut Random::new(seed);
        let frame = Frame::new(width, height);
        let (x, y) = (random.between(-20, 20), random.between(-20, 20));
        let area = Rect { x, y, width, height };
        let size = [1.5, 4.0, 12.0, 40.0][usize::try_from(random.between(0, 3)).expect("positive")];
        let positions: Vec<Vec4> = (0..40)
            .flat_map(|_| {
                let mut at = |size: u32| size as f32 * 1.4 * (random.unit() - 0.2);
                let (x, y) = (at(width), at(height));
                [(); 3].map(|()| {
                    let [dx, dy] = [(); 2].map(|()| size * random.unit());
                    frame.place(x + dx, y + dy, random.unit(), 1.0 + random.unit())
                })
            })
            .collect();
        let mut rasterizer = Rasterizer::<()>::new(
            Viewport::new(x as f32, y as f32, width as f32, height as f32).expect("legal")
        );
        let scissor = random.choose(&[tiles(area, &mut Random::new(!seed))[0], area]);
        rasterizer.scissor = Some(scissor);
        let stride = width as usize + padding;
        let draw = |in_runs: bool| {
            let len = stride * height as usize;
            let (mut color, mut depth) = (vec![7u32; len], vec![1.0f32; len]);
            let target = Surface::with_planes(&mut color[..], &mut depth[..], area, stride);
            let mut target = target.expect("it fits");
            let mut statistics = [halfplane::Statistics::default(); 3];
            let over = |fragment: Fragment<'_, ()>, under: u32| {
                (fragment.primitive_index() % 3 > 0).then(|| under.wrapping_mul(31) ^ fragment.depth().to_bits())
            };
            let (all, some) = (Primitives::list(), Primitives::list().part(0, 20));
            let depth_alone = rasterizer.with_depth_test(halfplane::LessOrEqual);
            if in_runs {
                let target = &mut InRuns(target);
                statistics[0] = rasterizer.draw_over(target, some, &positions[..], (), over).expect("legal");
                statistics[1] = depth_alone.draw_depth(target, all, &positions[..]).expect("legal");
                statistics[2] = depth_alone.draw(target, all, &positions[..], (), |_| 5).expect("legal");
            } else {
                statistics[0] = rasterizer.draw_over(&mut target, some, &positions[..], (), over).expect("legal");
                statistics[1] = depth_alone.draw_depth(&mut target, all, &positions[..]).expect("legal");
                statistics[2] = depth_alone.draw(&mut target, all, &positions[..], (), |_| 5).expect("legal");
            }
            (color, depth.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>(), statistics)
        };
        let (blocks, runs) = (draw(false), draw(true));
        prop_assert_eq!(&blocks, &runs);
        for (i, pixel) in blocks.0.iter().zip(&blocks.1).enumerate() {
            let [column, row] = [i % stride, i / stride].map(|place| i32::try_from(place).expect("small"));
            let is_outside = column >= width.cast_signed() || !scissor.contains(x + column, y + row);
            prop_assert!(!is_outside || pixel == (&7, &1.0f32.to_bits()), "({}, {}) stays: {:?}", column, row, scissor);
        }
    }

    /// All six orders of a triangle's vertices: the same samples, depths, values and derivatives, and the same weights in
    /// another order. (Of triangles that are not clipped.)
    #[test]
    fn the_order_of_vertices_changes_no_bit(
        corners in prop::array::uniform3((-20.0f32..68.0, -20.0f32..60.0, 0.0f32..1.0, 0.1f32..20.0)),
        grid in prop::sample::select(vec![2.0f32, 256.0, 1e5]), small in any::<bool>(),
    ) {
        let vertex = |(x, y, depth, w): (f32, f32, f32, f32)| {
            let [x, y] = if small { [x / 8.0 + 20.0, y / 8.0 + 20.0] } else { [x, y] };
            FRAME.place((x * grid).round() / grid, (y * grid).round() / grid, depth, w)
        };
        let positions = corners.map(vertex);
        // The flat value must not depend on the vertex, because another one provokes.
        let values = corners.map(|(x, y, ..)| mixed(x, y, 4));
        let reordered = |order: [usize; 3]| {
            let drawn =
                records_of(&rasterizer(), FRAME.area(), &order.map(|i| positions[i]), &order.map(|i| values[i]));
            drawn
                .into_iter()
                .map(|mut record| {
                    let (weights, barycentrics) = (record.weights, record.barycentrics);
                    for (i, from) in order.into_iter().enumerate() {
                        (record.weights[from], record.barycentrics[from]) = (weights[i], barycentrics[i]);
                    }
                    record
                })
                .collect::<Vec<_>>()
        };
        let expected = reordered([0, 1, 2]);
        for order in [[1, 2, 0], [2, 0, 1]] {
            prop_assert_eq!(&reordered(order), &expected, "{:?}", order);
        }
        for order in [[0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            let mut turned = reordered(order);
            for record in &mut turned {
                record.is_front_facing = !record.is_front_facing;
            }
            prop_assert_eq!(&turned, &expected, "{:?}", order);
        }
    }

    /// The order that the closure sees is the documented one: by triangle, rows from the top, left to right.
    #[test]
    fn fragments_come_by_triangle_then_row_then_column(seed in any::<u64>()) {
        let (positions, values) = scene(seed);
        // Pieces of a clipped triangle come one after the other: leave clipping out.
        let (positions, values): (Vec<Vec4>, Vec<Mixed>) = positions
            .chunks(3)
            .zip(values.chunks(3))
            .filter(|(corners, _)| corners.iter().all(|c| c.w > 0.0 && c.z >= 0.0 && c.z <= c.w && c.x.abs() < c.w * 99.0))
            .flat_map(|(corners, values)| corners.iter().copied().zip(values.iter().copied()))
            .unzip();
        let drawn = records_of(&rasterizer(), FRAME.area(), &positions, &values);
        let order = |record: &Record| (record.primitive, record.y, record.x);
        prop_assert!(drawn.is_sorted_by_key(order), "order");
    }

    /// Indices of any type, vertices projected beforehand, and each layout of attributes: different words for one picture.
    #[test]
    fn the_same_said_otherwise_is_the_same_picture(seed in any::<u64>()) {
        let (positions, values) = scene(seed);
        let expected = records_of(&rasterizer(), FRAME.area(), &positions, &values);
        let list = Primitives::list();
        let target = &mut Nowhere::new(FRAME.area());
        let rasterizer = rasterizer();

        // Indices into the vertices in reverse, each of them twice there.
        let (mut reversed, mut reversed_values) = (positions.clone(), values.clone());
        reversed.reverse();
        reversed_values.reverse();
        reversed.extend_from_within(..);
        reversed_values.extend_from_within(..);
        let count = u8::try_from(positions.len()).expect("few");
        let bytes: Vec<u8> = (0..count).map(|i| if i % 2 == 0 { count - 1 - i } else { 2 * count - 1 - i }).collect();
        let shorts: Vec<u16> = bytes.iter().copied().map(u16::from).collect();
        let words: Vec<u32> = bytes.iter().copied().map(u32::from).collect();
        let (p, v) = (&reversed[..], &reversed_values[..]);
        prop_assert_eq!(&records(&rasterizer, target, list.indexed(&bytes), p, v), &expected, "u8");
        prop_assert_eq!(&records(&rasterizer, target, list.indexed(&shorts), p, v), &expected, "u16");
        prop_assert_eq!(&records(&rasterizer, target, list.indexed(&words), p, v), &expected, "u32");
        let buffer = IndexBuffer::new(&words[..]);
        prop_assert_eq!(&records(&rasterizer, target, list.indexed_by(&buffer), p, v), &expected, "buffer");

        // Projected beforehand, into more room than needed.
        let mut room = [ProjectedVertex::default(); 60];
        let projected = rasterizer.project(&positions[..], &mut room).expect("there is room");
        prop_assert_eq!(&records(&rasterizer, target, list, projected, &values[..]), &expected, "projected");
        let mut room = [ProjectedVertex::default(); 60];
        let projected = rasterizer.project(p, &mut room).expect("there is room");
        prop_assert_eq!(&records(&rasterizer, target, list.indexed(&words), projected, v), &expected, "both");

        // Layouts.
        let structs: Vec<(Vec4, u64, Mixed)> = positions.iter().zip(&values).map(|(&p, &v)| (p, 99, v)).collect();
        let p = Attribute::field(&structs, |s| s.0);
        let v = Attribute::field(&structs, |s| s.2);
        prop_assert_eq!(&records(&rasterizer, target, list, p, v), &expected, "array of structs");
        let doubled: Vec<Vec4> = positions.iter().flat_map(|&p| [p, Vec4::NAN]).collect();
        let p = Attribute::slice(&doubled).with_stride(2);
        let v = Computed::new(values.len(), |i| values[i]);
        prop_assert_eq!(&records(&rasterizer, target, list, p, v), &expected, "stride 2, computed");
        let (smooth, (linear, flat)): (Vec<_>, (Vec<_>, Vec<_>)) = values.iter().map(|v| (v.0, (v.1, v.2))).unzip();
        let v = (&smooth[..], Attribute::slice(&linear), &flat[..]);
        prop_assert_eq!(&records(&rasterizer, target, list, &positions[..], v), &expected, "struct of arrays");

        let constant = values[0];
        let all = vec![constant; positions.len()];
        let expected = records(&rasterizer, target, list, &positions[..], &all[..]);
        let v = Attribute::constant(&constant);
        prop_assert_eq!(&records(&rasterizer, target, list, &positions[..], v), &expected, "constant");
        let v = Attribute::slice(&values).with_stride(0);
        prop_assert_eq!(&records(&rasterizer, target, list, &positions[..], v), &expected, "stride 0");
    }

    /// Strips and fans are lists of their triangles, with restarts and without.
    #[test]
    fn strips_and_fans_are_lists_of_their_triangles(seed in any::<u64>(), with_restart in any::<bool>()) {
        let (positions, values) = scene(seed);
        let random = &mut Random::new(!seed);
        let last = i32::try_from(positions.len()).expect("few") - 1;
        let indices: Vec<u16> = (0..random.between(0, 14))
            .map(|_| {
                let index = u16::try_from(random.between(0, last)).expect("small");
                if with_restart && random.between(0, 4) == 0 { u16::MAX } else { index }
            })
            .collect();
        let (mut strip, mut fan) = (Vec::new(), Vec::new());
        for part in indices.split(|&index| index == u16::MAX) {
            for (i, three) in part.windows(3).enumerate() {
                let &[a, b, c] = three else { continue };
                strip.extend(if i % 2 == 0 { [a, b, c] } else { [a, c, b] });
                fan.extend([b, c, part[0]]);
            }
        }
        let target = &mut Nowhere::new(FRAME.area());
        let rasterizer = rasterizer();
        let (p, v) = (&positions[..], &values[..]);
        for (primitives, list) in [(Primitives::strip(), strip), (Primitives::fan(), fan)] {
            let primitives = primitives.indexed(&indices);
            let primitives = if with_restart { primitives.with_restart() } else { primitives };
            let one = records(&rasterizer, target, primitives, p, v);
            let other = records(&rasterizer, target, Primitives::list().indexed(&list), p, v);
            prop_assert_eq!(one, other, "{:?} is {:?}", indices, list);
        }
    }

    /// The statistics of a draw add up.
    #[test]
    fn statistics_add_up(seed in any::<u64>(), scissored in any::<bool>()) {
        let (mut positions, values) = scene(seed);
        let random = &mut Random::new(!seed);
        let bad = random.choose(&[f32::NAN, f32::INFINITY, 1.0, 1.0]);
        positions[0].x *= bad;
        let mut rasterizer = rasterizer();
        rasterizer.cull_mode = random.choose(&[
            halfplane::CullMode::None, halfplane::CullMode::Front, halfplane::CullMode::Back,
        ]);
        rasterizer.scissor = scissored.then_some(Rect { x: 9, y: 9, width: 9, height: 9 });
        let (mut seen, mut kept) = (0, 0);
        let mut triangles = vec![false; positions.len() / 3];
        let statistics = rasterizer
            .draw(&mut Nowhere::new(FRAME.area()), Primitives::list(), &positions[..], &values[..], |fragment| {
                seen += 1;
                triangles[fragment.primitive_index() as usize] = true;
                let keep = (fragment.x() + fragment.y()) % 3 != 0;
                kept += u64::from(keep);
                keep.then_some(())
            })
            .expect("legal input");
        prop_assert_eq!(statistics.primitives, (positions.len() / 3) as u64, "primitives");
        prop_assert_eq!((statistics.fragments, statistics.samples_passed), (seen, kept), "fragments");
        let left_out = statistics.invalid + statistics.outside + statistics.culled + statistics.degenerate;
        let drawn = triangles.iter().filter(|&&drawn| drawn).count() as u64;
        prop_assert!(left_out + drawn <= statistics.primitives, "{:?}, {} drawn", statistics, drawn);
        prop_assert_eq!(statistics.invalid, u64::from(!bad.is_finite()), "{:?}", statistics);
        prop_assert!(statistics.clipped <= statistics.primitives - statistics.invalid - statistics.outside, "clipped");
    }
}

/// A frame far from the origin, in both directions, shows what the same frame shows at the origin.
#[test]
fn coverage_does_not_depend_on_where_the_frame_lies() {
    let random = &mut Random::new(77);
    for _ in 0..100 {
        let corners =
            [0, 1, 2].map(|_| [random.between(-20, 84) as f32 / 2.0, random.between(-20, 84) as f32 / 2.0]);
        let coverage = |x: f32, y: f32, left: i32, top: i32| {
            let viewport = Viewport::new(x, y, 32.0, 32.0).expect("legal");
            let area = Rect { x: left, y: top, width: 32, height: 32 };
            let positions = corners.map(|[x, y]| Vec4::new(x / 16.0 - 1.0, 1.0 - y / 16.0, 0.5, 1.0));
            let values = [mixed(1.0, 2.0, 3); 3];
            let records = records_of(&Rasterizer::new(viewport), area, &positions, &values);
            records.iter().map(|record| [record.x - left, record.y - top]).collect::<Vec<_>>()
        };
        let here = coverage(0.0, 0.0, 0, 0);
        assert_eq!(here, coverage(16_000.0, -16_000.0, 16_000, -16_000), "{corners:?}");
        assert_eq!(here, coverage(-16_000.0, 16_000.0, -16_000, 16_000), "{corners:?}");
    }
}
