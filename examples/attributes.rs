//! Vertex data stays where it is: arrays of their own, a field of an array of structs, or one value for all.
//!
//! A hundred triangles with the same gradient are drawn four times, each time in one draw: from a struct of arrays, from
//! an array of structs, with a constant colour (stride 0), and from all three at once.

mod support;

use core::error::Error;
use halfplane::glam::{Vec3, Vec4, vec3};
use halfplane::{
    Attribute, Attributes, Primitives, Rasterizer, Rect, Statistics, Surface, Viewport, pack_rgba8,
};
use support::image;

const SIDE: u32 = 320;
const PANELS: u32 = 4;

#[derive(Clone, Copy)]
struct Vertex {
    position: Vec4,
    color: Vec3,
}

fn main() -> Result<(), Box<dyn Error>> {
    let gradient = [vec3(0.1, 0.8, 0.7), vec3(0.4, 0.3, 1.0), vec3(1.0, 0.5, 0.3)];
    let corners = [(0.1, 0.1), (0.9, 0.1), (0.5, 0.9)];
    let array_of_structs: Vec<Vertex> = (0..300)
        .map(|i| {
            let (column, row) = (i / 3 % 10, i / 30);
            let (x, y) = corners[i % 3];
            let ndc = |cell: usize, offset: f32| ((cell as f32 + offset) / 5.0 - 1.0) * 0.95;
            let position = Vec4::new(ndc(column, x), ndc(row, y), 0.0, 1.0);
            Vertex { position, color: gradient[i % 3] }
        })
        .collect();
    let (positions, colors): (Vec<Vec4>, Vec<Vec3>) =
        array_of_structs.iter().map(|vertex| (vertex.position, vertex.color)).unzip();
    let teal = vec3(0.1, 0.6, 0.6);

    let (positions, colors) = (Attribute::slice(&positions), Attribute::slice(&colors));
    let fields = Attribute::field(&array_of_structs, |vertex| vertex.position);
    let field_colors = Attribute::field(&array_of_structs, |vertex| vertex.color);
    let constant = Attribute::constant(&teal);

    let mut pixels = vec![0xff26_1a18; (SIDE * SIDE * PANELS) as usize];
    let statistics = [
        draw(&mut pixels, 0, positions, colors, |color| color)?,
        draw(&mut pixels, 1, fields, field_colors, |color| color)?,
        draw(&mut pixels, 2, positions, constant, |color| color)?,
        // Several attributes in a tuple are one, and each may come from elsewhere.
        draw(&mut pixels, 3, fields, (colors, constant), |(color, teal)| color.lerp(teal, 0.5))?,
    ];

    let name = ["struct of arrays", "array of structs", "constant", "all of them"];
    for (name, drawn) in name.into_iter().zip(statistics) {
        println!("{name}: {} triangles, {} pixels", drawn.primitives, drawn.samples_passed);
        assert_eq!(drawn, statistics[0], "the same triangles");
    }
    for row in pixels.chunks((SIDE * PANELS) as usize) {
        let (separate, interleaved) = row[..2 * SIDE as usize].split_at(SIDE as usize);
        assert_eq!(separate, interleaved, "struct of arrays and array of structs have the same bits");
    }
    image::write_png(&image::output_path("attributes"), SIDE * PANELS, SIDE, &pixels)?;
    Ok(())
}

/// Draws to a square of the picture: a surface whose rows lie as far apart as the picture's.
fn draw<V: halfplane::Varyings>(
    pixels: &mut [u32],
    panel: u32,
    positions: impl Attributes<Value = Vec4>,
    varyings: impl Attributes<Value = V>,
    color: impl Fn(V) -> Vec3,
) -> Result<Statistics, Box<dyn Error>> {
    let pixels = &mut pixels[(panel * SIDE) as usize..];
    let stride = (SIDE * PANELS) as usize;
    let mut target =
        Surface::with_planes(pixels, halfplane::Absent::default(), Rect::of_size(SIDE, SIDE), stride)?;
    let rasterizer = Rasterizer::new(Viewport::of_size(SIDE, SIDE)?);
    let shade = |fragment: halfplane::Fragment<'_, V>| pack_rgba8(color(fragment.varyings()).extend(1.0));
    Ok(rasterizer.draw(&mut target, Primitives::list(), positions, varyings, shade)?)
}
