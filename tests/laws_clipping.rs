//! Laws of clipping: cutting at the eye, the near and far planes and the guard band is not seen, but at edges.
//!
//! The oracle never clips. In homogeneous coordinates (Olano and Greer 1997) the functions λ/w of a triangle's three
//! vertices, the sum of which is 1/w, and the depth z/w are linear on the screen, whatever lies behind the eye; and the
//! triangle is where all of λ/w, z/w and 1 − z/w are not negative. All of it is worked out in `f64`.

mod common;

use common::{Frame, Mixed, Nowhere, Random, Record, config, effort, mixed, records_of};
use glam::Vec4;
use halfplane::{
    DepthClip, Flat, NoPerspective, Primitives, ProvokingVertex, Rasterizer, Rect, Statistics, Surface,
};
use proptest::prelude::*;

const FRAME: Frame = Frame::new(48, 48);

/// A function that is linear on the screen: a x + b y + c, x and y in pixels.
type Line = [f64; 3];

fn at(line: Line, [x, y]: [f64; 2]) -> f64 {
    line[0] * x + line[1] * y + line[2]
}

/// How far from the line a point lies, in pixels.
fn distance(line: Line, point: [f64; 2]) -> f64 {
    at(line, point).abs() / line[0].hypot(line[1])
}

/// A triangle as homogeneous coordinates have it.
struct Homogeneous {
    /// λ/w of each vertex.
    parts: [Line; 3],
    inv_w: Line,
    /// z/w.
    depth: Line,
    /// Everything that is not negative inside.
    sides: Vec<Line>,
    /// How far the plane of the triangle passes from the eye, compared to how large it is.
    thickness: f64,
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

impl Homogeneous {
    fn new(triangle: [Vec4; 3], depth_clip: DepthClip) -> Self {
        let size = f64::from(FRAME.width);
        let points = triangle.map(|p| [p.x, p.y, p.w].map(f64::from));
        let [a, b, c] = points;
        let normals = [cross(b, c), cross(c, a), cross(a, b)];
        let determinant: f64 = (0..3).map(|i| a[i] * normals[0][i]).sum();
        // λ/w = normal · (x_ndc, y_ndc, 1) / determinant, and NDC are linear in pixels.
        let parts = normals
            .map(|[nx, ny, n1]| [2.0 * nx / size, -2.0 * ny / size, n1 - nx + ny].map(|c| c / determinant));
        let sum = |factors: [f64; 3]| [0, 1, 2].map(|k| (0..3).map(|i| factors[i] * parts[i][k]).sum());
        let inv_w: Line = sum([1.0; 3]);
        let depth: Line = sum(triangle.map(|p| p.z.into()));
        let mut sides = parts.to_vec();
        if depth_clip == DepthClip::Clip {
            sides.extend([depth, [-depth[0], -depth[1], 1.0 - depth[2]]]);
        }
        let thickness = determinant.abs() / points.map(length).iter().product::<f64>();
        Self { parts, inv_w, depth, sides, thickness }
    }

    fn is_inside(&self, point: [f64; 2]) -> bool {
        self.sides.iter().all(|&side| at(side, point) >= 0.0)
    }

    /// How far the nearest border lies, in pixels.
    fn distance(&self, point: [f64; 2]) -> f64 {
        self.sides
            .iter()
            .chain([&self.inv_w])
            .map(|&side| distance(side, point))
            .fold(f64::INFINITY, f64::min)
    }

    fn weights(&self, point: [f64; 2]) -> [f64; 3] {
        self.parts.map(|part| at(part, point) / at(self.inv_w, point))
    }
}

fn rasterizer(depth_clip: DepthClip) -> Rasterizer<Mixed> {
    let mut rasterizer = Rasterizer::new(FRAME.viewport());
    rasterizer.depth_clip = depth_clip;
    rasterizer
}

/// A point of eye space, z forward, in clip space: a right angle to see, and the near plane at 1/8.
fn see([x, y, z]: [f32; 3]) -> Vec4 {
    Vec4::new(x, y, z - 0.125, z)
}

/// Triangles of any size around the eye, of which most are cut: one corner or two behind it, through the planes of the
/// guard band, up to millions of pixels wide.
fn triangle() -> impl Strategy<Value = [Vec4; 3]> {
    let sizes = prop::sample::select(vec![1.0f32, 3.0, 30.0, 1e3, 1e5, 1e6]);
    let corner = [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0];
    (prop::array::uniform3((corner, sizes)), prop::sample::select(vec![1e-9f32, 0.125, 0.5])).prop_map(
        |(corners, step)| corners.map(|(corner, size)| see(corner.map(|c| (c * size / step).round() * step))),
    )
}

fn depth_clip() -> impl Strategy<Value = DepthClip> {
    prop::sample::select(vec![DepthClip::Clip, DepthClip::Clamp])
}

/// A function's value at a point, and how much it changes from there over 1/64 pixel.
fn around([x, y]: [f64; 2], f: &dyn Fn([f64; 2]) -> f64) -> (f64, f64) {
    const D: f64 = 1.0 / 64.0;
    let here = f([x, y]);
    let moved = [[x + D, y], [x - D, y], [x, y + D], [x, y - D]].map(|point| (f(point) - here).abs());
    (here, moved.into_iter().fold(0.0, f64::max))
}

fn sample(x: i32, y: i32) -> [f64; 2] {
    [x, y].map(|c| f64::from(c) + 0.5)
}

fn pixels() -> impl Iterator<Item = [i32; 2]> {
    (0..48).flat_map(|y| (0..48).map(move |x| [x, y]))
}

/// Planes that pass the eye nearer than this, for their size, are seen edge-on: where they are is up to the rounding of
/// their corners, clipped or not.
const EDGE_ON: f64 = 1e-5;

proptest! {
    #![proptest_config(config(200))]

    /// Only samples within 1/256 pixel of an edge may be covered otherwise than without clipping, and none twice.
    #[test]
    fn clipping_changes_coverage_only_at_edges(triangle in triangle(), depth_clip in depth_clip()) {
        let truth = Homogeneous::new(triangle, depth_clip);
        prop_assume!(truth.thickness > EDGE_ON);
        let mut counts = vec![0u8; FRAME.len()];
        let mut target = Surface::color_only(&mut counts, FRAME.width, FRAME.height).expect("it fits");
        let values = [mixed(0.0, 0.0, 0); 3];
        rasterizer(depth_clip)
            .draw_over(&mut target, Primitives::list(), &triangle, &values, |_, count| count + 1)
            .expect("legal input");
        for ([x, y], count) in pixels().zip(counts) {
            let sample = sample(x, y);
            let (expected, distance) = (u8::from(truth.is_inside(sample)), truth.distance(sample));
            prop_assert!(
                count == expected || (count < 2 && distance < 1.0 / 256.0),
                "({x}, {y}) is drawn {count} times, {distance} px from an edge"
            );
        }
    }

    /// The same of triangles up to millions of pixels wide, seen from the front, whose corners lie far out of the guard band.
    /// Cuts are worked out in `f32`, to about 2⁻²⁴ of the distance of the ends: that comes on top.
    #[test]
    fn clipping_changes_coverage_of_huge_triangles_only_at_edges(
        corners in prop::array::uniform3([-1.0f32..1.0, -1.0f32..1.0]),
        size in prop::sample::select(vec![3e4f32, 1e5, 1e6, 4e6]), through in [0.0f32..48.0, 0.0f32..48.0],
    ) {
        // The middle of the first edge lies in the frame.
        let [a, b, c] = corners.map(|corner| corner.map(|c| c * size));
        let offset = [0, 1].map(|i| through[i] - (a[i] + b[i]) * 0.5);
        let triangle = [a, b, c].map(|[x, y]| FRAME.at([x + offset[0], y + offset[1]]));
        let truth = Homogeneous::new(triangle, DepthClip::Clip);
        prop_assume!(truth.parts.iter().all(|part| part.iter().all(|c| c.is_finite())));
        let counts = FRAME.counts(&triangle);
        let bound = 1.0 / 256.0 + f64::from(size) / f64::from(1 << 24);
        for ([x, y], count) in pixels().zip(counts) {
            let sample = sample(x, y);
            let (expected, distance) = (u8::from(truth.is_inside(sample)), truth.distance(sample));
            prop_assert!(
                count == expected || (count < 2 && distance < bound),
                "({x}, {y}) is drawn {count} times, {distance} px from an edge"
            );
        }
    }

    /// Depth, weights and values are those of the whole triangle, within what they change over 1/64 pixel. (Corners move
    /// by 1/512 pixel when they are rounded, and more when that makes a needle wider or narrower.)
    #[test]
    fn clipping_changes_values_as_little_as_rounding_the_corners(
        triangle in triangle(), depth_clip in depth_clip(),
    ) {
        let truth = Homogeneous::new(triangle, depth_clip);
        prop_assume!(truth.thickness > 1e-3);
        let vertices = [1.0f32, 0.0, -2.0];
        let values = vertices.map(|v| mixed(v, 0.0, 5));
        for record in records_of(&rasterizer(depth_clip), FRAME.area(), &triangle, &values) {
            let sample = sample(record.x, record.y);
            let around = |f: &dyn Fn([f64; 2]) -> f64| around(sample, f);
            // Within a pixel of an edge, next to a vanishing point, or in a needle a corner's error counts many times.
            if truth.distance(sample) < 0.25 {
                continue;
            }
            let float = |bits: u32| f64::from(f32::from_bits(bits));
            for i in 0..3 {
                let (weight, change) = around(&|point| truth.weights(point)[i]);
                let error = (float(record.weights[i]) - weight).abs();
                prop_assert!(error < change + 1e-5, "weight {} is not {weight}: {:?}", float(record.weights[i]), record);
            }
            let mean = |point| (0..3).map(|i| truth.weights(point)[i] * f64::from(vertices[i])).sum();
            let (value, change) = around(&mean);
            let error = (float(record.values[0]) - value).abs();
            prop_assert!(error < change + 1e-5, "value {} is not {value}: {:?}", float(record.values[0]), record);
            let (depth, change) = around(&|point| at(truth.depth, point).clamp(0.0, 1.0));
            let error = (float(record.depth) - depth).abs();
            prop_assert!(error < change + 2e-5, "depth {} is not {depth}: {:?}", float(record.depth), record);
            let (inv_w, change) = around(&|point| at(truth.inv_w, point));
            let error = (float(record.inv_w) - inv_w).abs();
            prop_assert!(error < change + 1e-5 * inv_w, "1/w {} is not {inv_w}: {:?}", float(record.inv_w), record);
            prop_assert_eq!(record.values[3], 5, "flat values survive whole");
        }
    }

    /// So are barycentrics, λ w_a / w, where all of the triangle lies before the eye.
    #[test]
    fn clipping_changes_barycentrics_as_little_as_rounding_the_corners(
        triangle in triangle(), depth_clip in depth_clip(),
    ) {
        const BOUND: f32 = 1.0 / (1 << 20) as f32;
        // Between the eye and the near plane instead of behind the eye.
        let triangle = triangle.map(|v| if v.w > 0.01 { v } else { Vec4::new(v.x, v.y, -0.1, 0.025) });
        let truth = Homogeneous::new(triangle, depth_clip);
        prop_assume!(truth.thickness > 1e-3);
        for record in records_of(&rasterizer(depth_clip), FRAME.area(), &triangle, &[mixed(0.0, 0.0, 0); 3]) {
            let (sample, told) = (sample(record.x, record.y), record.barycentrics.map(f32::from_bits));
            prop_assert!((told.iter().sum::<f32>() - 1.0).abs() <= BOUND, "sum: {:?}", told);
            prop_assert!(told.iter().all(|b| (-BOUND..=1.0 + BOUND).contains(b)), "range: {:?}", told);
            for i in 0..3 {
                let (barycentric, change) =
                    around(sample, &|point| at(truth.parts[i], point) * f64::from(triangle[i].w));
                let error = (f64::from(told[i]) - barycentric).abs();
                let bound = change + 1e-5 * barycentric.abs().max(1.0);
                prop_assert!(
                    error < bound || truth.distance(sample) < 0.25,
                    "{} is not {barycentric}: {:?}", told[i], record
                );
            }
        }
    }

    /// The bounds of weights hold for clipped triangles too.
    #[test]
    fn weights_of_clipped_triangles_sum_to_one_and_stay_within(triangle in triangle(), depth_clip in depth_clip()) {
        const BOUND: f32 = 1.0 / (1 << 20) as f32;
        let values = [mixed(3.0, 4.0, 6); 3];
        for record in records_of(&rasterizer(depth_clip), FRAME.area(), &triangle, &values) {
            let weights = record.weights.map(f32::from_bits);
            prop_assert!((weights.iter().sum::<f32>() - 1.0).abs() <= BOUND, "sum: {:?}", weights);
            prop_assert!(weights.iter().all(|w| (-BOUND..=1.0 + BOUND).contains(w)), "range: {:?}", weights);
            let equal = f32::from_bits(record.values[0]);
            prop_assert!((equal - 3.0).abs() < 4e-6, "equal values stay equal: {}", equal);
            // Barycentrics are anything if a vertex lies behind the eye.
            if triangle.iter().all(|vertex| vertex.w > 0.0) {
                let linear = f32::from_bits(record.values[2]);
                prop_assert!((linear - 3.0).abs() < 4e-6, "on the screen, too: {}", linear);
            }
            let depth = f32::from_bits(record.depth);
            prop_assert!((0.0..=1.0).contains(&depth), "depth {}", depth);
        }
    }

    /// A plane that is cut into a mesh, and the mesh by the near plane, the eye and the guard band, has neither holes nor
    /// doubles.
    #[test]
    fn a_clipped_mesh_is_watertight(
        cells in 2i32..9, origin in [-0.3f32..0.3, -0.3f32..0.3, -0.3f32..0.3],
        u in [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0], v in [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0],
        size in prop::sample::select(vec![2.0f32, 20.0, 1e3, 1e5]),
        depth_clip in depth_clip(), seed in any::<u64>(),
    ) {
        let random = &mut Random::new(seed);
        let step = 2.0 / cells as f32;
        let mut vertices = Vec::new();
        for (i, j) in (0..=cells).flat_map(|j| (0..=cells).map(move |i| (i, j))) {
            let inner = i > 0 && i < cells && j > 0 && j < cells;
            let [s, t] = [i, j].map(|i| {
                i as f32 * step - 1.0 + if inner { random.range(-0.2, 0.2) * step } else { 0.0 }
            });
            vertices.push(see([0, 1, 2].map(|k| origin[k] + (s * u[k] + t * v[k]) * size)));
        }
        let vertex = |i: i32, j: i32| vertices[usize::try_from(j * (cells + 1) + i).expect("not negative")];
        let mut triangles = Vec::new();
        for (i, j) in (0..cells).flat_map(|j| (0..cells).map(move |i| (i, j))) {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            let (one, other) = random.choose(&[([a, b, c], [a, c, d]), ([b, c, d], [b, d, a])]);
            // Neighbours need not start at the same vertex.
            triangles.extend([one, random.choose(&[other, [other[2], other[0], other[1]]])]);
        }
        random.shuffle(&mut triangles);

        let (size, cells) = (vertices.len(), usize::try_from(cells).expect("few"));
        let [a, b, c, d] = [0, cells, size - 1, size - 1 - cells].map(|i| vertices[i]);
        let halves = [Homogeneous::new([a, b, c], depth_clip), Homogeneous::new([a, c, d], depth_clip)];
        prop_assume!(halves.iter().all(|half| half.thickness > EDGE_ON));

        // Fronts less backs: the corners are rounded, so a plane seen nearly edge-on may fold.
        let mut counts = vec![0i8; FRAME.len()];
        let mut target = Surface::color_only(&mut counts, FRAME.width, FRAME.height).expect("it fits");
        let mut rasterizer = Rasterizer::<()>::new(FRAME.viewport());
        rasterizer.depth_clip = depth_clip;
        rasterizer
            .draw_over(&mut target, Primitives::list(), triangles.as_flattened(), (), |fragment, count| {
                count + if fragment.is_front_facing() { 1 } else { -1 }
            })
            .expect("legal input");
        let side = counts.iter().find(|&&count| count != 0).map_or(1, |&count| i64::from(count.signum()));
        let complaint = FRAME.complaint(&counts, |x, y, count| {
            let sample = sample(x, y);
            // The outline is not drawn by anyone else. (Its rounding was in `f32`: be generous about where it is.)
            let outline = [halves[0].parts[0], halves[0].parts[2], halves[1].parts[0], halves[1].parts[1]];
            let depths = halves[0].sides.iter().skip(3);
            let near_an_end =
                outline.iter().chain(depths).chain([&halves[0].inv_w]).any(|&line| distance(line, sample) < 0.25);
            let expected = i64::from(halves.iter().any(|half| half.is_inside(sample)));
            count * side == expected || near_an_end
        });
        prop_assert!(complaint.is_none(), "{complaint:?}");
    }

    /// As many fronts as backs show through a closed surface that reaches out of the guard band, in any way.
    #[test]
    fn closed_surfaces_beyond_the_guard_band_show_as_many_fronts_as_backs(
        corners in prop::array::uniform4([-1.0f32..1.0, -1.0f32..1.0]),
        sizes in prop::array::uniform4(prop::sample::select(vec![10.0f32, 100.0, 16_000.0, 17_000.0, 1e5, 1e6])),
        grid in prop::sample::select(vec![2.0f32, 256.0, 1e4]),
    ) {
        let corners = [0, 1, 2, 3].map(|i| {
            FRAME.at(corners[i].map(|c: f32| (c * sizes[i] * grid).round() / grid))
        });
        let tetrahedron = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]].as_flattened();
        let positions: Vec<Vec4> = tetrahedron.iter().map(|&i: &usize| corners[i]).collect();
        let counts = FRAME.signed_counts(&positions);
        let complaint = FRAME.complaint(&counts, |_, _, count| count == 0);
        prop_assert!(complaint.is_none(), "{complaint:?}");
    }
}

fn draw(triangle: [Vec4; 3], depth_clip: DepthClip) -> (Vec<Record>, Statistics) {
    let rasterizer = rasterizer(depth_clip);
    let values = [mixed(0.0, 0.0, 1), mixed(1.0, 0.0, 2), mixed(0.0, 1.0, 3)];
    let mut records = Vec::new();
    let statistics = rasterizer
        .draw(&mut Nowhere::new(FRAME.area()), Primitives::list(), &triangle, &values, |fragment| {
            records.push(Record::of(&fragment));
        })
        .expect("legal input");
    (records, statistics)
}

#[test]
fn what_lies_behind_the_eye_is_outside() {
    for depth_clip in [DepthClip::Clip, DepthClip::Clamp] {
        let (drawn, statistics) =
            draw([see([0.0, 1.0, -1.0]), see([-1.0, -1.0, -1.0]), see([1.0, -1.0, -1.0])], depth_clip);
        assert!(drawn.is_empty() && statistics.outside == 1, "{statistics:?}");
    }
}

#[test]
fn what_lies_before_the_near_plane_or_beyond_the_far_one_is_cut_or_clamped() {
    for depth in [-0.5, 1.5] {
        let triangle = [[0.0, 0.0], [0.0, 40.0], [40.0, 0.0]].map(|[x, y]| FRAME.place(x, y, depth, 1.0));
        let (drawn, statistics) = draw(triangle, DepthClip::Clip);
        assert!(drawn.is_empty() && statistics.outside == 1, "{statistics:?}");
        let (drawn, statistics) = draw(triangle, DepthClip::Clamp);
        assert_eq!((drawn.len(), statistics.clipped), (40 * 39 / 2, 0), "nothing is cut");
        let expected = depth.clamp(0.0f32, 1.0);
        assert!(drawn.iter().all(|record| f32::from_bits(record.depth) == expected), "clamped to {expected}");
    }
}

#[test]
fn the_near_plane_cuts_where_depth_is_zero() {
    // Depth runs from −1 at the left to 1 at the right side of the frame, so the left half is cut away.
    let corner = |x: f32, y: f32| FRAME.place(x, y, x / 24.0 - 1.0, 1.0);
    let (drawn, statistics) =
        draw([corner(0.0, -48.0), corner(0.0, 96.0), corner(48.0, 24.0)], DepthClip::Clip);
    assert_eq!(statistics.clipped, 1, "{statistics:?}");
    assert!(drawn.iter().all(|record| record.x >= 24), "the left half");
    assert_eq!(drawn.iter().filter(|record| record.x == 24).count(), 48, "the first column after the cut");
    let (drawn, statistics) =
        draw([corner(0.0, -48.0), corner(0.0, 96.0), corner(48.0, 24.0)], DepthClip::Clamp);
    assert_eq!(statistics.clipped, 0, "{statistics:?}");
    let depth_of =
        |x: i32| drawn.iter().find(|record| (record.x, record.y) == (x, 24)).map(|r| f32::from_bits(r.depth));
    assert_eq!(depth_of(3), Some(0.0), "clamped");
    assert!(depth_of(36).is_some_and(|depth| (depth - (36.5 / 24.0 - 1.0)).abs() < 1e-6), "and not");
}

#[test]
fn flat_values_survive_clipping_and_name_the_whole_triangles_vertex() {
    for behind in 0..3 {
        let mut triangle = [see([0.0, 1.0, 2.0]), see([-1.0, -1.0, 2.0]), see([1.0, -1.0, 2.0])];
        triangle[behind] = see([0.0, 0.1, -1.0]);
        let (drawn, statistics) = draw(triangle, DepthClip::Clip);
        assert!(statistics.clipped == 1 && !drawn.is_empty(), "{statistics:?}");
        assert!(drawn.iter().all(|record| record.values[3] == 1), "the first vertex provokes, behind or not");
        let fronts = drawn.iter().filter(|record| record.is_front_facing).count();
        assert!(fronts == 0 || fronts == drawn.len(), "all pieces face one way");
        assert!(drawn.iter().all(|record| record.primitive == 0), "they are one primitive");
        // By the other convention the last one provokes, drawn at once or prepared before.
        let mut last = rasterizer(DepthClip::Clip);
        last.provoking_vertex = ProvokingVertex::Last;
        let values = [mixed(0.0, 0.0, 1), mixed(1.0, 0.0, 2), mixed(0.0, 1.0, 3)];
        let flat = |records: &[Record]| records.iter().map(|record| record.values[3]).collect::<Vec<_>>();
        let expected = vec![3; drawn.len()];
        assert_eq!(flat(&records_of(&last, FRAME.area(), &triangle, &values)), expected, "the last vertex");
        let mut room = [halfplane::Record::default(); 1];
        let mut preparation =
            last.prepare(FRAME.area(), Primitives::list(), &triangle, &values).expect("legal input");
        let batch = preparation.fill(&mut room).expect("there is room").expect("it may be seen");
        let mut prepared = Vec::new();
        last.draw_prepared(&mut Nowhere::new(FRAME.area()), batch, |fragment| {
            prepared.push(Record::of(&fragment));
        });
        assert_eq!(flat(&prepared), expected, "prepared");
    }
}

#[test]
fn triangles_of_a_million_pixels_are_drawn() {
    let far = 1e6;
    let triangle = [[-far, -far], [-far, 3.0 * far], [3.0 * far, -far]].map(|point| FRAME.at(point));
    let (drawn, statistics) = draw(triangle, DepthClip::Clip);
    assert_eq!((drawn.len(), statistics.clipped), (FRAME.len(), 1), "the whole frame");
}

/// What can be seen of a triangle in a plane through the eye is a line, whose ends are rounded to the subpixel grid.
///
/// Found by this file: an edge that the eye's plane cuts *in* the eye has no place on the screen there, and 0/0 was taken
/// for one.
#[test]
fn a_triangle_in_a_plane_through_the_eye_covers_at_most_its_line() {
    for [x, y] in [[0.0, 0.0], [0.5, 0.0], [0.25, -0.75]] {
        for third in [[1.0, 0.0], [1.0, 1.0], [-0.5, 0.7], [0.0, -3.0]] {
            for depth_clip in [DepthClip::Clip, DepthClip::Clamp] {
                let third = Vec4::new(third[0], third[1], 0.5, 1.0);
                let triangle = [Vec4::new(x, y, 0.5, 1.0), Vec4::new(-x, -y, -0.5, -1.0), third];
                let pixel = |p: Vec4| {
                    let half = f64::from(FRAME.width) / 2.0;
                    [(1.0 + f64::from(p.x)) * half, (1.0 - f64::from(p.y)) * half]
                };
                let (from, to) = (pixel(triangle[0]), pixel(third));
                let [nx, ny] = [from[1] - to[1], to[0] - from[0]];
                let line = [nx, ny, -(nx * from[0] + ny * from[1])];
                for fragment in draw(triangle, depth_clip).0 {
                    let distance = distance(line, sample(fragment.x, fragment.y));
                    assert!(distance < 1.0 / 128.0, "({x}, {y}) {third}: {distance} px beside the line");
                }
            }
        }
    }
}

/// Found by this file: next to the eye, the far end of an edge counts for little, and so does its rounding.
#[test]
fn edges_from_near_the_eye_to_far_away_keep_their_place() {
    for triangle in [
        [[762_094.5, 675_403.0, 819_877.0], [0.0, 0.0, 1.0], [-0.5, -0.5, -0.5]],
        [[-0.084, 0.295, 0.3554], [0.0, -998_664.0, -933_323.0], [0.0, 0.0, 0.206]],
    ] {
        let triangle = triangle.map(see);
        for depth_clip in [DepthClip::Clip, DepthClip::Clamp] {
            let truth = Homogeneous::new(triangle, depth_clip);
            let (drawn, _) = draw(triangle, depth_clip);
            let drawn: Vec<[i32; 2]> = drawn.iter().map(|record| [record.x, record.y]).collect();
            for [x, y] in pixels() {
                let sample = sample(x, y);
                assert!(
                    drawn.contains(&[x, y]) == truth.is_inside(sample)
                        || truth.distance(sample) < 1.0 / 256.0,
                    "({x}, {y}) of {triangle:?}, {} px from an edge",
                    truth.distance(sample)
                );
            }
        }
    }
}

/// Meshes with vertices exactly on the borders of the guard band and of clip space.
#[test]
fn vertices_on_the_borders_leave_no_holes() {
    let random = &mut Random::new(5);
    let near_border = |random: &mut Random, side: f32| {
        let border = side * 16_384.0;
        random.choose(&[border, border, border.next_up(), border.next_down(), border + side, border * 1.5])
    };
    for _ in 0..effort(40) {
        let middle = [random.between(8, 88), random.between(8, 88)].map(|c| c as f32 / 2.0);
        let corner =
            |random: &mut Random, sx: f32, sy: f32| [near_border(random, sx), near_border(random, sy)];
        let along = random.range(-9000.0, 9000.0);
        let rim = [
            corner(random, -1.0, -1.0),
            [near_border(random, -1.0), along],
            corner(random, -1.0, 1.0),
            [along, near_border(random, 1.0)],
            corner(random, 1.0, 1.0),
            [near_border(random, 1.0), along],
            corner(random, 1.0, -1.0),
            [along, near_border(random, -1.0)],
        ];
        let depth = random.choose(&[0.0, 1.0, 0.5]);
        let place = |[x, y]: [f32; 2]| FRAME.place(x, y, depth, 1.0);
        let positions: Vec<Vec4> = (0..rim.len())
            .flat_map(|i| [place(middle), place(rim[i]), place(rim[(i + 1) % rim.len()])])
            .collect();
        FRAME.assert_all(&FRAME.counts(&positions), &format!("{rim:?}"), |_, _, count| count == 1);
    }
}

/// A sliver along a row or a column of samples, up to 1/32 pixel high.
fn sliver(random: &mut Random) -> [[f32; 2]; 3] {
    let height = random.choose(&[0.002f32, 0.004, 0.008, 0.016]);
    let (middle, is_upright) = (random.between(0, 47) as f32 + 0.5, random.choose(&[true, false]));
    [(); 3].map(|()| {
        let (along, across) = (random.range(-12.0, 60.0), middle + random.range(-height, height));
        if is_upright { [across, along] } else { [along, across] }
    })
}

/// What is left of a sliver is bent when its corners are rounded: a piece of it may be turned over, and lie upon another.
#[test]
fn slivers_through_the_near_plane_draw_no_sample_twice() {
    let random = &mut Random::new(6);
    for _ in 0..effort(1500) {
        let triangle = sliver(random)
            .map(|[x, y]| FRAME.place(x, y, random.range(-1.0, 1.0), random.choose(&[0.3, 1.0, 1.0, 5.0])));
        FRAME.assert_all(&FRAME.counts(&triangle), &format!("{triangle:?}"), |_, _, count| count < 2);
    }
}

/// Found by a search among slivers: where a polygon of five or six corners was bent, two pieces covered the same samples.
#[test]
fn slivers_through_the_guard_band_draw_no_sample_twice() {
    let frame = Frame::new(64, 64);
    for triangle in [
        [
            [167.400_63, -168.119_43, 0.5, 1.0],
            [1111.6934, -1112.4122, 0.5, 1.0],
            [-1734.7281, 1734.0095, 0.5, 1.0],
        ],
        [
            [344.294_13, -172.092_45, 0.5, 1.0],
            [3082.4785, -1541.1846, 0.5, 1.0],
            [-1060.1667, 530.1382, 0.5, 1.0],
        ],
        [
            [2911.94, -727.559_27, 0.5, 1.0],
            [-2939.886, 735.397_16, 0.5, 1.0],
            [464.830_38, -115.781_69, 0.5, 1.0],
        ],
        [
            [0.066_356_16, -0.020_534_4, -0.003_776_580_6, -0.01],
            [-12.140_722, 4.218_666, 0.061_428_8, 3.0],
            [20.572_62, -3.959_393_3, 2.580_33, 3.0],
        ],
        [
            [0.854_249_95, -0.446_626_6, 0.475_287_05, 0.5],
            [-0.404_295_44, 0.163_026_57, 0.274_491_55, 1.0],
            [-0.019_584_246, 0.010_182_285, -0.009_230_114, -0.01],
        ],
    ] {
        let counts = frame.counts(&triangle.map(Vec4::from_array));
        frame.assert_all(&counts, &format!("{triangle:?}"), |_, _, count| count < 2);
        assert!(counts.contains(&1), "it can be seen: {triangle:?}");
    }
}

/// Values without perspective, of a cut triangle are linear on the screen, and those of the whole one where it is all in front.
#[test]
fn no_perspective_values_of_a_cut_triangle_are_linear() {
    let corner = |x: f32, y: f32, w: f32| FRAME.place(x, y, (x - 12.0) / 48.0, w);
    let triangle = [corner(0.0, -48.0, 1.0), corner(0.0, 96.0, 3.0), corner(48.0, 24.0, 5.0)];
    let values = [NoPerspective(0.0f32), NoPerspective(10.0), NoPerspective(-4.0)];
    let draw = |depth_clip| {
        let mut picture: Vec<Option<f32>> = vec![None; FRAME.len()];
        let mut target = Surface::color_only(&mut picture, FRAME.width, FRAME.height).expect("it fits");
        let mut rasterizer = Rasterizer::<(NoPerspective<f32>, Flat<u8>)>::new(FRAME.viewport());
        rasterizer.depth_clip = depth_clip;
        let flat = [Flat(1u8); 3];
        rasterizer
            .draw(&mut target, Primitives::list(), &triangle, (&values, &flat), |fragment| {
                Some(Some(fragment.varyings().0.0))
            })
            .expect("legal input");
        picture
    };
    let (cut, whole) = (draw(DepthClip::Clip), draw(DepthClip::Clamp));
    let mut compared = 0;
    for (cut, whole) in cut.into_iter().zip(whole) {
        if let (Some(cut), Some(whole)) = (cut, whole) {
            let difference: f32 = cut - whole;
            assert!(difference.abs() < 5e-3, "{cut} {whole}");
            compared += 1;
        }
    }
    assert!(compared > 500, "{compared}");
}

/// The guard band is so far away that a frame of any size up to its own never sees it.
#[test]
fn the_frame_does_not_see_the_guard_band() {
    let all = [[-4.0, -4.0], [-4.0, 12.0], [12.0, -4.0]].map(|[x, y]| Vec4::new(x, y, 0.5, 1.0));
    for area in [
        Rect { x: 16_360, y: 16_360, width: 23, height: 23 },
        Rect { x: -16_383, y: -16_383, width: 23, height: 23 },
    ] {
        let viewport = halfplane::Viewport::new(-16_383.0, -16_383.0, 32_766.0, 32_766.0).expect("legal");
        let values = [mixed(0.0, 0.0, 0); 3];
        let drawn = records_of(&Rasterizer::new(viewport), area, &all, &values);
        assert_eq!(drawn.len(), 23 * 23, "{area:?}");
    }
}
