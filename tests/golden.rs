//! A few whole scenes, exact to the byte.
//!
//! `tests/golden/*.png` hold what is expected. A picture that differs is written beside the others under `target/`, with
//! a picture of the differences, and the message says where. To accept what is drawn now as right, look at it and copy it.

mod common;

use core::fmt::Write as _;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use common::Frame;
use glam::{Vec2, Vec3, Vec4};
use halfplane::{
    CullMode, Flat, Less, NoPerspective, Primitives, Rasterizer, ReadOnly, Surface, floor_to_i32, pack_rgba8,
    unpack_rgba8,
};

const FRAME: Frame = Frame::new(96, 64);

/// RGBA, R in the lowest eight bits.
type Pixels = Vec<u32>;

fn bytes(pixels: &[u32]) -> Vec<u8> {
    pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect()
}

fn write(path: &Path, pixels: &[u32]) {
    let file = File::create(path).expect("target/ can be written to");
    let mut encoder = png::Encoder::new(file, FRAME.width, FRAME.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("target/ can be written to");
    writer.write_image_data(&bytes(pixels)).expect("as many bytes as the header says");
}

/// The picture of a file of 8-bit RGBA, if there is one of the right size.
fn read(path: &Path) -> Option<Pixels> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path).ok()?)).read_info().ok()?;
    let mut bytes = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut bytes).ok()?;
    let is_expected = (info.width, info.height) == (FRAME.width, FRAME.height)
        && (info.color_type, info.bit_depth) == (png::ColorType::Rgba, png::BitDepth::Eight);
    is_expected.then(|| bytes.chunks_exact(4).map(|p| u32::from_le_bytes([p[0], p[1], p[2], p[3]])).collect())
}

/// Compares with `tests/golden/{name}.png`.
#[track_caller]
fn assert_golden(name: &str, actual: &[u32]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let expected = read(&root.join("tests/golden").join(name).with_extension("png")).unwrap_or_default();
    if actual == expected {
        return;
    }
    let directory = root.join("target/golden");
    fs::create_dir_all(&directory).expect("target/ can be written to");
    let path = |kind: &str| -> PathBuf { directory.join(format!("{name}-{kind}.png")) };
    write(&path("actual"), actual);
    let mut message = format!("{name}: drawn is {}", path("actual").display());
    if expected.len() == actual.len() {
        // White where they differ, and what is expected in the dark elsewhere.
        let difference: Pixels = actual
            .iter()
            .zip(&expected)
            .map(
                |(actual, expected)| {
                    if actual == expected { expected >> 2 & 0x003f_3f3f | 0xff00_0000 } else { !0 }
                },
            )
            .collect();
        write(&path("difference"), &difference);
        let count = difference.iter().filter(|&&pixel| pixel == !0).count();
        let _ = write!(message, ", {count} pixels differ: {}", path("difference").display());
    } else {
        let _ = write!(message, ", and there is nothing of its size to compare it with");
    }
    panic!("{message}");
}

/// Eye space, y up and z forward, in clip space: the frame is 3 : 2, the near plane at ¼ and the far one at 64.
fn see(point: Vec3) -> Vec4 {
    let Vec3 { x, y, z } = point;
    Vec4::new(x, y * 1.5, (z - 0.25) * (64.0 / 63.75), z)
}

/// A floor that runs from behind the eye to the horizon, with a checker that perspective and the near plane bend, cut and
/// fade if they are wrong; and beside it the same without perspective.
#[test]
fn floor() {
    let mut pixels = vec![0xff40_2010; FRAME.len()];
    let mut depth = vec![1.0f32; FRAME.len()];
    let mut target = Surface::new(&mut pixels, &mut depth, FRAME.width, FRAME.height).expect("it fits");
    let checker = |uv: Vec2, tint: Vec3, footprint: f32| {
        let is_odd = (floor_to_i32(uv.x) + floor_to_i32(uv.y)) & 1;
        // What is smaller than a pixel is grey: derivatives say when.
        let sharpness = (2.0 - 2.0 * footprint).clamp(0.0, 1.0);
        let shade = 0.5 + (is_odd as f32 - 0.5) * sharpness;
        pack_rgba8((tint * (0.3 + 0.7 * shade)).extend(1.0))
    };
    let corner = |x: f32, z: f32| (see(Vec3::new(x, -1.0, z)), Vec2::new(x, z));
    let corners = [corner(-20.0, -3.0), corner(20.0, -3.0), corner(20.0, 60.0), corner(-20.0, 60.0)];
    let (positions, coordinates): (Vec<Vec4>, Vec<Vec2>) = corners.into_iter().unzip();
    let statistics = Rasterizer::<Vec2>::new(FRAME.viewport())
        .draw(
            &mut target,
            Primitives::list().indexed(&[0u16, 1, 2, 0, 2, 3]),
            &positions[..],
            &coordinates[..],
            |f| {
                let (dx, dy) = (f.varyings_dx().abs(), f.varyings_dy().abs());
                checker(f.varyings(), Vec3::new(0.9, 1.0, 0.6), (dx + dy).max_element())
            },
        )
        .expect("legal input");
    assert_eq!(statistics.clipped, 2, "both halves cross the near plane: {statistics:?}");

    // A board that stands in it, once with perspective and once without.
    let board = |left: f32| {
        [(0.0, -1.0), (1.6, -1.0), (1.6, 0.8), (0.0, 0.8)]
            .map(|(x, y)| (see(Vec3::new(left + x, y, 2.0 + x * 1.5)), Vec2::new(x * 4.0, y * 4.0)))
    };
    let quad = Primitives::list().indexed(&[0u8, 1, 2, 0, 2, 3]);
    let right = board(0.3);
    Rasterizer::<Vec2>::new(FRAME.viewport())
        .draw(&mut target, quad, &right.map(|c| c.0), &right.map(|c| c.1), |f| {
            checker(f.varyings(), Vec3::new(1.0, 0.5, 0.3), 0.0)
        })
        .expect("legal input");
    let left = board(-2.2);
    Rasterizer::<NoPerspective<Vec2>>::new(FRAME.viewport())
        .draw(&mut target, quad, &left.map(|c| c.0), &left.map(|c| NoPerspective(c.1)), |f| {
            checker(f.varyings().0, Vec3::new(0.3, 0.5, 1.0), 0.0)
        })
        .expect("legal input");
    assert_golden("floor", &pixels);
}

/// Triangles through one another, with 16 bits of depth: the lines of intersection are the depth test's.
#[test]
fn intersection() {
    let mut pixels = vec![0xff20_2020; FRAME.len()];
    let mut depth = vec![u16::MAX; FRAME.len()];
    let mut target = Surface::new(&mut pixels, &mut depth, FRAME.width, FRAME.height).expect("it fits");
    let corners = [
        Vec3::new(-1.8, -0.9, 2.0),
        Vec3::new(0.4, -1.1, 6.0),
        Vec3::new(-0.2, 1.3, 2.5),
        Vec3::new(1.5, -0.8, 2.0),
        Vec3::new(0.3, 1.2, 2.8),
        Vec3::new(-1.9, -0.1, 4.0),
        Vec3::new(-1.6, 0.9, 2.2),
        Vec3::new(-1.4, 0.4, 2.2),
        Vec3::new(2.6, -0.2, 4.5),
    ];
    let positions = corners.map(see);
    let shades: Vec<(f32, Flat<Vec3>)> = (0..9)
        .map(|i| {
            (
                [1.0, 0.6, 0.3][i % 3],
                Flat([Vec3::new(1.0, 0.4, 0.3), Vec3::new(0.4, 1.0, 0.4), Vec3::ONE][i / 3]),
            )
        })
        .collect();
    let mut rasterizer = Rasterizer::new(FRAME.viewport());
    rasterizer.cull_mode = CullMode::None;
    rasterizer
        .draw(&mut target, Primitives::list(), &positions, &shades[..], |fragment| {
            let (light, Flat(color)) = fragment.varyings();
            pack_rgba8((color * if fragment.is_front_facing() { light } else { light * 0.5 }).extend(1.0))
        })
        .expect("legal input");
    assert_golden("intersection", &pixels);
}

/// Glass over an opaque triangle: blended in the order of the draw, hidden where the opaque one is nearer, with round
/// holes that are discarded.
#[test]
fn blending() {
    let mut pixels = vec![0xffff_ffff; FRAME.len()];
    let mut depth = vec![1.0f32; FRAME.len()];
    let mut target = Surface::new(&mut pixels, &mut depth, FRAME.width, FRAME.height).expect("it fits");
    let opaque =
        [(8.0, 60.0, 0.2), (70.0, 34.0, 0.8), (20.0, 4.0, 0.5)].map(|(x, y, z)| FRAME.place(x, y, z, 1.0));
    let rasterizer = Rasterizer::<Vec2>::new(FRAME.viewport());
    let coordinates = [Vec2::new(0.0, 0.0), Vec2::new(6.0, 0.0), Vec2::new(0.0, 6.0)];
    rasterizer
        .draw(&mut target, Primitives::list(), &opaque, &coordinates, |fragment| {
            let offset = fragment.varyings() - Vec2::new(1.5, 1.5);
            (offset.length_squared() > 0.7).then(|| pack_rgba8(Vec4::new(0.2, 0.3, 0.4, 1.0)))
        })
        .expect("legal input");
    let panes = [
        (
            [(30.0, 8.0, 0.4), (30.0, 40.0, 0.4), (80.0, 40.0, 0.4), (80.0, 8.0, 0.4)],
            Vec3::new(1.0, 0.1, 0.1),
        ),
        (
            [(5.0, 24.0, 0.45), (5.0, 56.0, 0.45), (60.0, 56.0, 0.45), (60.0, 24.0, 0.45)],
            Vec3::new(0.1, 0.8, 0.1),
        ),
        (
            [(50.0, 20.0, 0.6), (50.0, 62.0, 0.6), (92.0, 62.0, 0.6), (92.0, 20.0, 0.6)],
            Vec3::new(0.1, 0.2, 1.0),
        ),
    ];
    for (corners, color) in panes {
        let positions = corners.map(|(x, y, z)| FRAME.place(x, y, z, 1.0));
        Rasterizer::<()>::new(FRAME.viewport())
            .with_depth_test(ReadOnly(Less))
            .draw_over(&mut target, Primitives::fan(), &positions, (), |_, below| {
                let below = unpack_rgba8(below);
                pack_rgba8(below + (color.extend(1.0) - below) * 0.5)
            })
            .expect("legal input");
    }
    assert_golden("blending", &pixels);
}
