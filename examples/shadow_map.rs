//! A shadow map: depth as the light sees it, drawn without colour, and asked again in the main pass.
//!
//! A surface that is compared with its own stored depth shadows itself in stripes, as on the left: between two samples of
//! the map the true depth rises over the stored one. `DepthBias` moves the stored depths away from the light, by what the
//! slope of each triangle demands, as on the right.

mod support;

use core::error::Error;
use halfplane::glam::{Vec3, camera::rh::proj::directx, vec3};
use halfplane::{
    Computed, DepthBias, DepthFormat, Primitives, Rasterizer, Rect, Surface, Viewport, floor_to_i32,
};
use support::{camera::OrbitCamera, image, mesh::Mesh, shade::unit, teapot};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 540;
/// The shadow map's width and height in texels, and how far it reaches from the middle of the scene.
const MAP: u32 = 1024;
const REACH: f32 = 3.6;

fn main() -> Result<(), Box<dyn Error>> {
    let mesh = teapot_on_a_floor();
    let primitives = Primitives::list().indexed(&mesh.indices);
    let camera = OrbitCamera { pitch: 30.0, distance: 3.8, radius: 3.6, ..OrbitCamera::default() };
    let world_to_clip = camera.view_projection(WIDTH as f32 / HEIGHT as f32);
    // The sun: an orthographic camera far away.
    let sun = OrbitCamera { yaw: -50.0, pitch: 40.0, distance: 4.0, ..OrbitCamera::default() };
    let world_to_sun = directx::orthographic(-REACH, REACH, -REACH, REACH, 0.1, 8.0) * sun.view();
    let to_sun = unit(sun.eye());

    let mut pixels = vec![0xffe0_c8b0; (WIDTH * HEIGHT) as usize];
    let mut depth = vec![1.0_f32; (WIDTH * HEIGHT) as usize];
    let mut target = Surface::new(&mut pixels, &mut depth, WIDTH, HEIGHT)?;
    let biases = [DepthBias::default(), DepthBias { constant: 1.0, slope: 2.0, clamp: 0.05 }];
    for (left, depth_bias) in [0, WIDTH / 2].into_iter().zip(biases) {
        // The sun's pass: depth alone, 16 bits.
        let mut map = vec![u16::MAX; (MAP * MAP) as usize];
        let mut shadow = Rasterizer::<()>::new(Viewport::of_size(MAP, MAP)?);
        shadow.depth_bias = depth_bias;
        let positions = Computed::new(mesh.positions.len(), |i| world_to_sun * mesh.positions[i].extend(1.0));
        let mut map_surface = Surface::depth_only(&mut map, MAP, MAP)?;
        let seen = shadow.draw(&mut map_surface, primitives, positions, (), |_| ())?;

        // The viewer's pass. A fragment is lit as far as the map around it holds nothing nearer to the sun.
        let lit = |point: Vec3| {
            let ndc = world_to_sun.transform_point3(point);
            let depth = u16::from_depth(ndc.z);
            let x = floor_to_i32((1.0 + ndc.x) * 0.5 * MAP as f32);
            let y = floor_to_i32((1.0 - ndc.y) * 0.5 * MAP as f32);
            let stored = |x: i32, y: i32| map.get(y as usize * MAP as usize + x as usize);
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            let nearer = around.filter(|&(x, y)| stored(x, y).is_some_and(|&stored| stored < depth));
            1.0 - nearer.count() as f32 / 9.0
        };
        let mut main = Rasterizer::<(Vec3, Vec3)>::new(Viewport::of_size(WIDTH, HEIGHT)?);
        main.scissor = Some(Rect { x: left as i32, y: 0, width: WIDTH / 2, height: HEIGHT });
        let positions =
            Computed::new(mesh.positions.len(), |i| world_to_clip * mesh.positions[i].extend(1.0));
        let varyings = (&mesh.positions[..], &mesh.normals[..]);
        let drawn = main.draw(&mut target, primitives, positions, varyings, |fragment| {
            let (position, normal) = fragment.varyings();
            let side = if fragment.is_front_facing() { 1.0 } else { -1.0 };
            let sun = (unit(normal).dot(to_sun) * side).max(0.0) * lit(position);
            let sky = 0.6 + 0.4 * normal.y * side;
            image::encode(vec3(0.16, 0.20, 0.28) * sky + vec3(0.72, 0.62, 0.48) * sun)
        })?;
        println!("{} texels seen by the sun, {} pixels shaded", seen.samples_passed, drawn.samples_passed);
    }

    // In the foreground the floor lies in the sun, and all of it is equally bright.
    let (lit, own_shadow) = (pixels[((HEIGHT - 1) * WIDTH + WIDTH / 2) as usize], |left: u32, lit: u32| {
        let foreground = (HEIGHT - 40..HEIGHT).flat_map(|y| (left..left + WIDTH / 2).map(move |x| (x, y)));
        foreground.filter(|(x, y)| pixels[(y * WIDTH + x) as usize] != lit).count()
    });
    let [without, with] = [own_shadow(0, lit), own_shadow(WIDTH / 2, lit)];
    println!("pixels that shadow themselves: {without} without bias, {with} with");
    assert!(without > 1000 && with == 0, "the bias keeps the floor out of its own shadow");

    image::write_png(&image::output_path("shadow_map"), WIDTH, HEIGHT, &pixels)?;
    Ok(())
}

fn teapot_on_a_floor() -> Mesh {
    let mut mesh = teapot::tessellate(16, |_, _| ());
    mesh.fit_unit_sphere();
    let floor = mesh.positions.iter().fold(0.0, |low: f32, p| low.min(p.y));
    let first = u32::try_from(mesh.positions.len()).expect("a small mesh");
    mesh.positions.extend(
        [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(x, z)| vec3(x * 2.5, floor, z * 2.5)),
    );
    mesh.normals.extend([Vec3::Y; 4]);
    mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    mesh
}
