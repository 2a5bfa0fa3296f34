//! Small pictures that pin down which pixels a triangle covers and which side it shows.
//!
//! A digit says how often a pixel is drawn, a blank that it never is. Coordinates are in pixels, y down, so samples lie
//! at .5.

mod common;

use common::{Frame, assert_picture};
use glam::Vec4;
use halfplane::{
    Absent, Attribute, CullMode, Flat, FrontFace, Primitives, ProvokingVertex, Rasterizer, Rect, Surface,
    Topology, Viewport,
};

const FRAME: Frame = Frame::new(8, 6);

type Point = [f32; 2];

/// Two triangles that share the diagonal from (x0, y0) to (x1, y1).
fn quad(x0: f32, y0: f32, x1: f32, y1: f32) -> Vec<Point> {
    vec![[x0, y0], [x0, y1], [x1, y1], [x0, y0], [x1, y1], [x1, y0]]
}

fn place(points: &[Point]) -> Vec<Vec4> {
    points.iter().map(|&point| FRAME.at(point)).collect()
}

/// How often each pixel is drawn by a list of triangles.
#[track_caller]
fn assert_coverage(points: &[Point], expected: &[&str]) {
    assert_picture(&FRAME.counts(&place(points)), expected);
}

// ---- The fill rule ----

#[test]
fn samples_on_top_and_left_edges_are_covered_and_others_are_not() {
    assert_coverage(
        &quad(1.5, 1.5, 4.5, 3.5),
        &[
            "        ", //
            " 111    ", // top and left edges in,
            " 111    ", // bottom and right edges out
            "        ", "        ", "        ",
        ],
    );
}

#[test]
fn edges_between_samples_include_neither_side() {
    assert_coverage(
        &quad(1.0, 1.0, 4.0, 3.0),
        &[
            "        ", //
            " 111    ", " 111    ", "        ", "        ", "        ",
        ],
    );
}

#[test]
fn a_subpixel_decides() {
    const SUBPIXEL: f32 = 1.0 / 256.0;
    assert_coverage(
        &quad(1.5 + SUBPIXEL, 1.5 + SUBPIXEL, 4.5 + SUBPIXEL, 3.5 + SUBPIXEL),
        &[
            "        ", //
            "        ", "  111   ", "  111   ", "        ", "        ",
        ],
    );
    assert_coverage(
        &quad(1.5 - SUBPIXEL, 1.5 - SUBPIXEL, 4.5 - SUBPIXEL, 3.5 - SUBPIXEL),
        &[
            "        ", //
            " 111    ", " 111    ", "        ", "        ", "        ",
        ],
    );
}

#[test]
fn a_slanted_left_edge_keeps_its_samples() {
    assert_coverage(
        &[[5.5, 0.5], [0.5, 5.5], [5.5, 5.5]],
        &[
            "        ", // the top vertex is also on the right edge
            "    1   ", "   11   ", "  111   ", " 1111   ", "        ",
        ],
    );
}

#[test]
fn a_slanted_right_edge_gives_its_samples_away() {
    assert_coverage(
        &[[0.5, 0.5], [0.5, 5.5], [5.5, 5.5]],
        &[
            "        ", //
            "1       ", "11      ", "111     ", "1111    ", "        ",
        ],
    );
}

#[test]
fn a_bottom_edge_gives_its_samples_away_and_a_top_edge_keeps_them() {
    assert_coverage(
        &[[0.5, 0.5], [3.5, 3.5], [6.5, 0.5]],
        &[
            "111111  ", //
            " 1111   ", "  11    ", "        ", "        ", "        ",
        ],
    );
    assert_coverage(
        &[[0.5, 3.5], [6.5, 3.5], [3.5, 0.5]],
        &[
            "        ", //
            "  11    ", " 1111   ", "        ", "        ", "        ",
        ],
    );
}

#[test]
fn the_sample_is_the_centre_of_the_pixel() {
    // A box around the centre of pixel (3, 2), a quarter pixel wide.
    assert_coverage(
        &quad(3.375, 2.375, 3.625, 2.625),
        &[
            "        ", //
            "        ", "   1    ", "        ", "        ", "        ",
        ],
    );
    // Boxes around its corners.
    for [x, y] in [[3.0, 2.0], [4.0, 2.0], [3.0, 3.0], [4.0, 3.0]] {
        assert_coverage(&quad(x - 0.25, y - 0.25, x + 0.25, y + 0.25), &["        "; 6]);
    }
}

#[test]
fn a_triangle_of_one_subpixel_covers_its_sample_or_nothing() {
    const SUBPIXEL: f32 = 1.0 / 256.0;
    // The right angle at the top left: the sample is at the meeting of the top and the left edge.
    assert_coverage(
        &[[2.5, 2.5], [2.5, 2.5 + SUBPIXEL], [2.5 + SUBPIXEL, 2.5]],
        &["        ", "        ", "  1     ", "        ", "        ", "        "],
    );
    // And at the bottom right: nothing.
    assert_coverage(&[[2.5, 2.5], [2.5 - SUBPIXEL, 2.5], [2.5, 2.5 - SUBPIXEL]], &["        "; 6]);
}

#[test]
fn slivers_between_samples_cover_nothing_and_on_samples_once() {
    assert_coverage(&quad(0.0, 2.6, 8.0, 3.4), &["        "; 6]);
    assert_coverage(&quad(2.6, 0.0, 3.4, 6.0), &["        "; 6]);
    assert_coverage(
        &quad(0.0, 2.5, 8.0, 2.51),
        &["        ", "        ", "11111111", "        ", "        ", "        "],
    );
    assert_coverage(
        &quad(2.5, 0.0, 2.51, 6.0),
        &["  1     ", "  1     ", "  1     ", "  1     ", "  1     ", "  1     "],
    );
}

#[test]
fn a_thin_diagonal_steps_from_sample_to_sample() {
    assert_coverage(
        &[[0.5, 0.5], [0.5, 0.6], [5.5, 5.6], [0.5, 0.5], [5.5, 5.6], [5.5, 5.5]],
        &[
            "        ", //
            "        ", "        ", "        ", "        ", "        ",
        ],
    );
    assert_coverage(
        &[[0.5, 0.5], [5.5, 5.5], [5.6, 5.5], [0.5, 0.5], [5.6, 5.5], [0.6, 0.5]],
        &[
            "1       ", // its left edge runs through the samples
            " 1      ", "  1     ", "   1    ", "    1   ", "        ",
        ],
    );
}

// ---- Shared edges ----

#[test]
fn shared_edges_are_drawn_once_whichever_way_they_run() {
    let corners = [[1.5, 0.5], [6.5, 0.5], [6.5, 4.5], [1.5, 4.5]];
    let expected = [
        " 11111  ", //
        " 11111  ", " 11111  ", " 11111  ", "        ", "        ",
    ];
    let [a, b, c, d] = corners;
    assert_coverage(&[a, b, c, a, c, d], &expected);
    assert_coverage(&[a, b, d, d, b, c], &expected);
    assert_coverage(&[a, b, c, d, c, a], &expected);
}

#[test]
fn a_fan_around_a_sample_covers_it_once() {
    let rim =
        [[1.5, 0.5], [4.5, 0.5], [7.5, 0.5], [7.5, 2.5], [7.5, 5.5], [4.5, 5.5], [0.5, 5.5], [0.5, 3.5]];
    let fan: Vec<Point> = (0..8).flat_map(|i| [[4.5, 2.5], rim[i], rim[(i + 1) % rim.len()]]).collect();
    assert_coverage(
        &fan,
        &[
            " 111111 ", //
            " 111111 ", " 111111 ", "1111111 ", "1111111 ", "        ",
        ],
    );
}

#[test]
fn overlap_is_overdraw() {
    let mut points = quad(0.0, 0.0, 5.0, 3.0);
    points.extend(quad(3.0, 2.0, 7.0, 5.0));
    assert_coverage(
        &points,
        &[
            "11111   ", //
            "11111   ", "1112211 ", "   1111 ", "   1111 ", "        ",
        ],
    );
}

#[test]
fn no_area_covers_nothing() {
    assert_coverage(&[[0.5, 0.5], [3.5, 3.5], [5.5, 5.5]], &["        "; 6]);
    assert_coverage(&[[2.5, 2.5]; 3], &["        "; 6]);
    assert_coverage(&[[0.0, 2.5], [8.0, 2.5], [4.0, 2.5]], &["        "; 6]);
}

// ---- Turned and mirrored ----

#[test]
fn a_triangle_turned_and_mirrored() {
    // No sample on an edge, so that the tie rule has no say.
    let triangle = [[0.2, 0.2], [0.2, 3.2], [5.2, 0.2]];
    type Turn = fn(Point) -> Point;
    let pictures: [(Turn, [&str; 6]); 4] = [
        (|p| p, ["11111   ", "111     ", "1       ", "        ", "        ", "        "]),
        (|[x, y]| [8.0 - x, y], ["   11111", "     111", "       1", "        ", "        ", "        "]),
        (|[x, y]| [x, 6.0 - y], ["        ", "        ", "        ", "1       ", "111     ", "11111   "]),
        (
            |[x, y]| [8.0 - x, 6.0 - y],
            ["        ", "        ", "        ", "       1", "     111", "   11111"],
        ),
    ];
    for (turn, expected) in pictures {
        assert_coverage(&triangle.map(turn), &expected);
    }
    // A quarter turn, about the frame's corner and back into the frame.
    assert_coverage(
        &triangle.map(|[x, y]| [y, 6.0 - x]),
        &["        ", "1       ", "1       ", "11      ", "11      ", "111     "],
    );
}

// ---- Facing ----

/// What a pixel shows of a triangle: `1` its front, `2` its back.
fn sides(rasterizer: &Rasterizer<()>, points: &[Point]) -> Vec<u8> {
    let mut pixels = vec![0u8; FRAME.len()];
    let mut target = Surface::color_only(&mut pixels, FRAME.width, FRAME.height).expect("it fits");
    rasterizer
        .draw(&mut target, Primitives::list(), &place(points)[..], (), |fragment| {
            if fragment.is_front_facing() { 1u8 } else { 2u8 }
        })
        .expect("legal input");
    pixels
}

/// One triangle that turns counter-clockwise as displayed, and one that turns clockwise.
const BOTH: [Point; 6] = [[0.0, 0.0], [0.0, 4.0], [4.0, 4.0], [4.0, 0.0], [8.0, 0.0], [8.0, 4.0]];

#[test]
fn counter_clockwise_is_front_and_culling_obeys() {
    let picture = |cull_mode, front_face| {
        let mut rasterizer = Rasterizer::new(FRAME.viewport());
        (rasterizer.cull_mode, rasterizer.front_face) = (cull_mode, front_face);
        sides(&rasterizer, &BOTH)
    };
    assert_picture(
        &picture(CullMode::None, FrontFace::CounterClockwise),
        &["    2222", "1    222", "11    22", "111    2", "        ", "        "],
    );
    assert_picture(
        &picture(CullMode::Back, FrontFace::CounterClockwise),
        &["        ", "1       ", "11      ", "111     ", "        ", "        "],
    );
    assert_picture(
        &picture(CullMode::Front, FrontFace::CounterClockwise),
        &["    2222", "     222", "      22", "       2", "        ", "        "],
    );
    assert_picture(
        &picture(CullMode::None, FrontFace::Clockwise),
        &["    1111", "2    111", "22    11", "222    1", "        ", "        "],
    );
    assert_picture(
        &picture(CullMode::Back, FrontFace::Clockwise),
        &["    1111", "     111", "      11", "       1", "        ", "        "],
    );
}

#[test]
fn a_negative_height_turns_the_picture_and_its_faces_over() {
    let mut rasterizer = Rasterizer::new(Viewport::new(0.0, 6.0, 8.0, -6.0).expect("Vulkan allows it"));
    assert_picture(
        &sides(&rasterizer, &BOTH),
        &["        ", "        ", "222    1", "22    11", "2    111", "    1111"],
    );
    rasterizer.cull_mode = CullMode::Back;
    assert_picture(
        &sides(&rasterizer, &BOTH),
        &["        ", "        ", "       1", "      11", "     111", "    1111"],
    );
}

// ---- Viewport and scissor ----

#[test]
fn the_viewport_maps_and_bounds() {
    let whole = place(&quad(-8.0, -6.0, 16.0, 12.0));
    let counts = |viewport: Viewport, scissor| {
        let mut rasterizer = Rasterizer::new(viewport);
        rasterizer.scissor = scissor;
        FRAME.counts_of(&rasterizer, Primitives::list(), &whole)
    };
    let viewport = |x, y, width, height| Viewport::new(x, y, width, height).expect("legal");
    assert_picture(
        &counts(viewport(2.0, 1.0, 4.0, 3.0), None),
        &["        ", "  1111  ", "  1111  ", "  1111  ", "        ", "        "],
    );
    assert_picture(
        &counts(viewport(2.0, 4.0, 4.0, -3.0), None),
        &["        ", "  1111  ", "  1111  ", "  1111  ", "        ", "        "],
    );
    // A pixel belongs to it if its sample does: from 1.5 on, up to but without 4.5.
    assert_picture(
        &counts(viewport(1.5, 1.5, 3.0, 3.0), None),
        &["        ", " 111    ", " 111    ", " 111    ", "        ", "        "],
    );
    assert_picture(
        &counts(viewport(1.6, 1.6, 3.0, 3.0), None),
        &["        ", "        ", "  111   ", "  111   ", "  111   ", "        "],
    );
    assert_picture(
        &counts(FRAME.viewport(), Some(Rect { x: 5, y: 3, width: 100, height: 2 })),
        &["        ", "        ", "        ", "     111", "     111", "        "],
    );
    assert_picture(
        &counts(viewport(2.0, 1.0, 4.0, 3.0), Some(Rect { x: -3, y: 2, width: 6, height: 1 })),
        &["        ", "        ", "  1     ", "        ", "        ", "        "],
    );
    assert_picture(&counts(FRAME.viewport(), Some(Rect::default())), &["        "; 6]);
    assert_picture(&counts(viewport(100.0, 0.0, 8.0, 6.0), None), &["        "; 6]);
}

#[test]
fn half_of_clip_space_is_half_of_the_viewport() {
    let positions = [[-1.0, 1.0], [-1.0, 0.0], [0.0, 0.0], [-1.0, 1.0], [0.0, 0.0], [0.0, 1.0]]
        .map(|[x, y]| Vec4::new(x, y, 0.5, 1.0));
    assert_picture(
        &FRAME.counts(&positions),
        &["1111    ", "1111    ", "1111    ", "        ", "        ", "        "],
    );
}

// ---- Strips, fans, restarts, provoking vertices ----

/// The flat value of each pixel, one digit more than the number of the provoking vertex.
fn provoked<I: halfplane::Index>(
    primitives: Primitives<'_, I>,
    provoking_vertex: ProvokingVertex,
    points: &[Point],
) -> Vec<u8> {
    let mut pixels = vec![0u8; FRAME.len()];
    let mut target = Surface::color_only(&mut pixels, FRAME.width, FRAME.height).expect("it fits");
    let mut rasterizer = Rasterizer::<Flat<u8>>::new(FRAME.viewport());
    rasterizer.provoking_vertex = provoking_vertex;
    // All fronts are counter-clockwise: a triangle whose order is wrong disappears.
    rasterizer.cull_mode = CullMode::Back;
    let values: Vec<Flat<u8>> = (1..).map(Flat).take(points.len()).collect();
    rasterizer
        .draw(&mut target, primitives, &place(points)[..], &values[..], |fragment| fragment.varyings().0)
        .expect("legal input");
    pixels
}

/// A strip from left to right: even vertices above, odd ones below.
const ZIGZAG: [Point; 6] = [[0.0, 0.0], [0.0, 4.0], [4.0, 0.0], [4.0, 4.0], [8.0, 0.0], [8.0, 4.0]];

#[test]
fn a_strip_alternates_and_its_provoking_vertices_advance() {
    assert_picture(
        &provoked(Primitives::strip(), ProvokingVertex::First, &ZIGZAG),
        &["11123334", "11223344", "12223444", "22224444", "        ", "        "],
    );
    assert_picture(
        &provoked(Primitives::strip(), ProvokingVertex::Last, &ZIGZAG),
        &["33345556", "33445566", "34445666", "44446666", "        ", "        "],
    );
}

#[test]
fn a_restart_starts_a_strip_anew() {
    let indices = [0u8, 1, 2, 255, 2, 3, 4];
    assert_picture(
        &provoked(Primitives::strip().indexed(&indices).with_restart(), ProvokingVertex::First, &ZIGZAG),
        &["111 333 ", "11  33  ", "1   3   ", "        ", "        ", "        "],
    );
}

#[test]
fn a_fan_turns_around_its_first_vertex() {
    let points = [[0.0, 0.0], [0.0, 6.0], [8.0, 6.0], [8.0, 0.0]];
    let picture = |provoking| provoked(Primitives::new(Topology::Fan), provoking, &points);
    assert_picture(
        &picture(ProvokingVertex::First),
        &["23333333", "22333333", "22233333", "22222333", "22222233", "22222223"],
    );
    assert_picture(
        &picture(ProvokingVertex::Last),
        &["34444444", "33444444", "33344444", "33333444", "33333344", "33333334"],
    );
}

#[test]
fn lists_take_every_three() {
    let [a, b, c, d, e, f] = ZIGZAG;
    assert_picture(
        &provoked(Primitives::list(), ProvokingVertex::First, &[a, b, c, d, f, e, a]),
        &["111    4", "11    44", "1    444", "    4444", "        ", "        "],
    );
    assert_picture(
        &provoked(Primitives::list().indexed(&[5u32, 4, 3]), ProvokingVertex::Last, &ZIGZAG),
        &["       4", "      44", "     444", "    4444", "        ", "        "],
    );
}

#[test]
fn one_colour_for_every_vertex_and_one_for_each() {
    let positions = place(&ZIGZAG);
    let draw = |colors: Attribute<'_, Flat<u8>>| {
        let mut pixels = vec![0u8; FRAME.len()];
        let mut target = Surface::color_only(&mut pixels, FRAME.width, FRAME.height).expect("it fits");
        Rasterizer::new(FRAME.viewport())
            .draw(&mut target, Primitives::strip(), &positions[..], colors, |fragment| fragment.varyings().0)
            .expect("legal input");
        pixels
    };
    let colors = [6, 5, 4, 3, 2, 1].map(Flat);
    assert_picture(
        &draw(Attribute::slice(&colors)),
        &["66654443", "66554433", "65554333", "55553333", "        ", "        "],
    );
    assert_picture(
        &draw(Attribute::constant(&Flat(7))),
        &["77777777", "77777777", "77777777", "77777777", "        ", "        "],
    );
    assert_picture(
        &draw(Attribute::slice(&colors).with_stride(0)),
        &["66666666", "66666666", "66666666", "66666666", "        ", "        "],
    );
}

// ---- Part of a frame ----

#[test]
fn a_tile_shows_its_part_of_the_frame_and_padding_stays() {
    let mut memory = [0u8; 4 * 5];
    let tile = Rect { x: 2, y: 1, width: 3, height: 4 };
    let mut target = Surface::with_planes(&mut memory[..], Absent::default(), tile, 5).expect("it fits");
    let positions = place(&[[0.5, 0.5], [0.5, 5.5], [5.5, 5.5]]);
    Rasterizer::<()>::new(FRAME.viewport())
        .draw(&mut target, Primitives::list(), &positions[..], (), |_| 1u8)
        .expect("legal input");
    assert_picture(
        &memory,
        &[
            "     ", // columns 2 to 4, and two columns of padding
            "     ", "1    ", "11   ",
        ],
    );
}
