//! Derivatives choose the mip level: a floor to the horizon, without mip-mapping on the left and with it on the right.
//!
//! The fragment tells how much of the texture a pixel covers, exactly and without neighbours to take differences with:
//! `varyings_dx` and `varyings_dy` are ∂u/∂x and ∂u/∂y of everything that is interpolated.

mod support;

use core::error::Error;
use halfplane::glam::{Mat4, Vec2, camera::rh::proj::directx, vec2, vec3, vec4};
use halfplane::{Primitives, Rasterizer, Rect, Surface, Viewport};
use support::{image, texture::Texture};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 540;
const FAR: f32 = 400.0;

fn main() -> Result<(), Box<dyn Error>> {
    let texture = Texture::test_pattern();
    let mut pixels: Vec<u32> = (0..WIDTH * HEIGHT)
        .map(|i| {
            let down = (i / WIDTH) as f32 / HEIGHT as f32;
            image::encode(vec3(0.16, 0.36, 0.72).lerp(vec3(0.9, 0.85, 0.75), (down * 2.6).min(1.0)))
        })
        .collect();
    let mut target = Surface::color_only(&mut pixels, WIDTH, HEIGHT)?;

    // The floor y = 0, as wide as it is long, seen from one above it. Clipping cuts off what lies behind the eye.
    let camera = directx::perspective(60_f32.to_radians(), WIDTH as f32 / HEIGHT as f32, 0.1, FAR)
        * Mat4::from_rotation_x(0.3)
        * Mat4::from_translation(vec3(0.0, -1.0, 0.0));
    let corners = [vec2(-FAR, FAR), vec2(FAR, FAR), vec2(-FAR, -FAR), vec2(FAR, -FAR)];
    let positions = corners.map(|p| camera * vec4(p.x, 0.0, p.y, 1.0));
    let uvs = corners.map(|p| p * 0.4);

    let mut rasterizer = Rasterizer::<Vec2>::new(Viewport::of_size(WIDTH, HEIGHT)?);
    rasterizer.scissor = Some(Rect { x: 0, y: 0, width: WIDTH / 2, height: HEIGHT });
    let left = rasterizer.draw(&mut target, Primitives::strip(), &positions, &uvs, |fragment| {
        image::encode(texture.bilinear(fragment.varyings()))
    })?;

    rasterizer.scissor = Some(Rect { x: WIDTH as i32 / 2, y: 0, width: WIDTH / 2, height: HEIGHT });
    let right = rasterizer.draw(&mut target, Primitives::strip(), &positions, &uvs, |fragment| {
        let lod = texture.level_of_detail(fragment.varyings_dx(), fragment.varyings_dy());
        image::encode(texture.trilinear(fragment.varyings(), lod))
    })?;
    println!("{} + {} pixels of the floor", left.samples_passed, right.samples_passed);
    assert_eq!(left.clipped, 2, "both triangles reach behind the eye");

    // From afar a pixel covers many squares. Their mean varies little, a single one anyhow.
    let horizon = HEIGHT - u32::try_from(left.samples_passed)? / (WIDTH / 2);
    let far_rows = horizon + 4..horizon + 24;
    let [without, with] = [0, WIDTH / 2].map(|left| {
        let green = |x: u32, y: u32| (pixels[(y * WIDTH + x) as usize] >> 8 & 0xff) as f32;
        let columns = left..left + WIDTH / 2 - 1;
        let steps = far_rows
            .clone()
            .flat_map(|y| columns.clone().map(move |x| (green(x, y) - green(x + 1, y)).abs()));
        steps.sum::<f32>() / (far_rows.len() * columns.len()) as f32
    });
    println!("from pixel to pixel near the horizon: {without:.1} / 255 without mip-mapping, {with:.1} with");
    assert!(with * 10.0 < without, "mip-mapping quietens the horizon");
    image::write_png(&image::output_path("mipmap"), WIDTH, HEIGHT, &pixels)?;
    Ok(())
}
