//! One triangle, its colours blended between its corners, as a PNG file: all that a picture needs.

use halfplane::glam::{vec3, vec4};
use halfplane::{Primitives, Rasterizer, Surface, Viewport, pack_rgba8};

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let (width, height) = (640, 480);
    let mut pixels = vec![[24, 26, 38, 255]; 640 * 480]; // any pixel format; here R, G, B, A
    let mut target = Surface::color_only(&mut pixels, width, height)?;

    // Clip space: (0, 0) is the middle, x points right, y up, and the frame ends at ±1.
    let positions = [vec4(-0.7, -0.7, 0.0, 1.0), vec4(0.7, -0.7, 0.0, 1.0), vec4(0.0, 0.8, 0.0, 1.0)];
    let colors = [vec3(0.1, 0.8, 0.7), vec3(0.4, 0.3, 1.0), vec3(1.0, 0.5, 0.3)];

    let rasterizer = Rasterizer::new(Viewport::of_size(width, height)?);
    let drawn = rasterizer.draw(&mut target, Primitives::list(), &positions, &colors, |fragment| {
        pack_rgba8(fragment.varyings().extend(1.0)).to_le_bytes()
    })?;
    assert_eq!(drawn.samples_passed, 448 * 360 / 2, "base × height / 2: every sample, exactly once");

    std::fs::create_dir_all("target/examples-output")?;
    let file = std::fs::File::create("target/examples-output/hello_triangle.png")?;
    let mut png = png::Encoder::new(file, width, height);
    png.set_color(png::ColorType::Rgba);
    png.write_header()?.write_image_data(pixels.as_flattened())?;
    println!("drew {} pixels to target/examples-output/hello_triangle.png", drawn.samples_passed);
    Ok(())
}
