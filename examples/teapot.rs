//! The Utah teapot, or any OBJ file: lit, checkered, from any side.
//!
//! ```text
//! cargo run --release --example teapot
//! cargo run --release --example teapot -- --level 64 --yaw 200 --output pot.png
//! cargo run --release --example teapot -- model.obj
//! ```
//!
//! A whole small renderer: vertices projected once each, a mesh drawn in batches with a progress bar, a floating-point
//! framebuffer, shadows from a light with an extent, and several samples a pixel.

mod support;

use clap::Parser;
use core::{error::Error, ops::RangeInclusive, time::Duration};
use halfplane::glam::{Mat4, Vec2, Vec3, Vec4, vec3};
use halfplane::{
    Computed, CullMode, DepthClip, Fragment, Primitives, ProjectedVertex, Rasterizer, Statistics, Surface,
    Viewport, floor_to_i32,
};
use indicatif::{ProgressBar, ProgressStyle};
use std::{path::PathBuf, process::ExitCode, time::Instant};
use support::{camera::OrbitCamera, image, mesh, mesh::Mesh, shade::smoothstep, shade::unit, teapot};

const LEVELS: RangeInclusive<i64> = teapot::MIN_LEVEL as i64..=teapot::MAX_LEVEL as i64;

/// Draws the Utah teapot, or an OBJ file, to a PNG file.
#[derive(Debug, Parser)]
struct Options {
    /// The OBJ file to draw instead of the teapot
    obj: Option<PathBuf>,
    /// Cells along each side of each of the teapot's 32 patches
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(LEVELS))]
    level: u32,
    /// The picture's size in pixels
    #[arg(long, default_value = "1280x960", value_parser = parse_size, value_name = "WIDTHxHEIGHT")]
    size: (u32, u32),
    /// Samples along each side of a pixel
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=8))]
    samples: u32,
    /// Degrees around the model; 0 is the side that faces +z
    #[arg(long, default_value_t = 30.0, allow_negative_numbers = true)]
    yaw: f32,
    /// Degrees above the horizon
    #[arg(long, default_value_t = 25.0, allow_negative_numbers = true)]
    pitch: f32,
    /// From the eye to the model's centre, in radii of the model [default: 3.5, and 4.1 for an OBJ file]
    #[arg(long)]
    distance: Option<f32>,
    /// Vertical field of view in degrees
    #[arg(long, default_value_t = 29.0)]
    fov: f32,
    /// Where to write the picture
    #[arg(long, short, default_value = "target/examples-output/teapot.png")]
    output: PathBuf,
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text.split_once('x').ok_or("not of the form 640x480")?;
    let side = |text: &str| match text.parse() {
        Ok(side @ 1..=16384) => Ok(side),
        _ => Err(format!("`{text}` is not a number of pixels from 1 to 16384")),
    };
    Ok((side(width)?, side(height)?))
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let mut mesh = match &options.obj {
        Some(path) => mesh::load_obj(path)?,
        None => tessellated_teapot(options.level)?,
    };
    mesh.fit_unit_sphere();
    let (triangles, vertices) = (mesh.triangles(), mesh.positions.len());
    println!("{triangles} triangles, {vertices} vertices in {}", milliseconds(start.elapsed()));

    let camera = OrbitCamera {
        yaw: options.yaw,
        pitch: options.pitch,
        // A sphere fits into the default view from 4 radii away; of that the teapot fills the middle.
        distance: options.distance.unwrap_or(if options.obj.is_some() { 4.1 } else { 3.5 }),
        fov: options.fov,
        ..OrbitCamera::default()
    };
    let (width, height) = options.size;
    let mut picture = Picture::new(width, height, options.samples)?;
    let scene = Scene::new(&camera, picture.aspect(), &mesh);

    let start = Instant::now();
    let shadow = Shadow::new(&scene, &mesh)?;
    println!("shadow in {}", milliseconds(start.elapsed()));

    picture.draw_floor(&scene, &shadow)?;
    let start = Instant::now();
    let drawn = picture.draw_mesh(&scene, &mesh)?;
    let time = start.elapsed();
    let rate = triangles as f64 / time.as_secs_f64() / 1e6;
    println!(
        "drawn in {}: {rate:.1} million triangles a second, {:.1} million fragments",
        milliseconds(time),
        drawn.fragments as f64 / 1e6
    );

    assert_eq!(drawn.primitives, triangles as u64, "every triangle was drawn, once");
    if drawn.invalid > 0 {
        println!("{} triangles have a corner that is no point", drawn.invalid);
    }
    if drawn.samples_passed == 0 {
        return Err("nothing of the model can be seen from there".into());
    }
    image::write_png(&options.output, width, height, &picture.resolve())?;
    Ok(())
}

/// The teapot, with a progress bar for high levels.
fn tessellated_teapot(level: u32) -> Result<Mesh, String> {
    let bar = progress("tessellating");
    let mesh = teapot::tessellate(level, |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    // The check takes longer than the teapot; what holds for a hundred cells holds for a thousand.
    if level <= 100 {
        teapot::check(&mesh, level)?;
    }
    Ok(mesh)
}

fn progress(what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent}% {eta}").expect("it is well formed");
    ProgressBar::new(0).with_style(style).with_message(what)
}

fn milliseconds(time: Duration) -> String {
    format!("{:.1} ms", time.as_secs_f64() * 1e3)
}

/// Where things are, in world space.
struct Scene {
    world_to_clip: Mat4,
    eye: Vec3,
    /// Unit vectors from the model to the middle of the light, and two across it.
    light: Vec3,
    light_across: [Vec3; 2],
    /// The height of the floor: the model stands on it.
    floor: f32,
}

impl Scene {
    fn new(camera: &OrbitCamera, aspect: f32, mesh: &Mesh) -> Self {
        // The light is to the left of the viewer, wherever he goes.
        let turn = Mat4::from_rotation_y(camera.yaw.to_radians());
        let light = vec3(-0.6, 0.68, 0.62).normalize();
        let right = light.cross(Vec3::Y).normalize();
        let [light, right, up] =
            [light, right, right.cross(light)].map(|direction| turn.transform_vector3(direction));
        let heights = mesh.positions.iter().map(|position| position.y);
        Self {
            world_to_clip: camera.view_projection(aspect),
            eye: camera.eye(),
            light,
            light_across: [right, up],
            floor: heights.filter(|y| y.is_finite()).fold(1.0, f32::min),
        }
    }

    /// Glazed porcelain: a checkered body under a clear coat that mirrors the studio.
    fn shade_mesh(&self, fragment: Fragment<'_, Surfel>) -> Vec3 {
        let (position, normal, uv) = fragment.varyings();
        // The teapot is open beside its lid, so back faces may be seen: from there the normal points the other way.
        let side = if fragment.is_front_facing() { 1.0 } else { -1.0 };
        let normal = unit(normal) * side;
        let to_eye = unit(self.eye - position);

        let square = floor_to_i32(uv.x * 4.0) ^ floor_to_i32(uv.y * 4.0);
        let paint = TEAL.lerp(IVORY, (square & 1) as f32);
        let sky = 0.5 + 0.5 * normal.y;
        let ambient = vec3(0.16, 0.14, 0.13).lerp(vec3(0.34, 0.38, 0.44), sky);
        // Light from a wide source reaches a little around the edge.
        let facing = (normal.dot(self.light) * 0.85 + 0.15).max(0.0);
        let diffuse = paint * (ambient + LIGHT * facing);

        let cosine = normal.dot(to_eye).clamp(0.0, 1.0);
        let mirrored = normal * (2.0 * normal.dot(to_eye)) - to_eye;
        // Schlick's approximation of Fresnel's reflectance, for glass.
        let grazing = 1.0 - cosine;
        let reflectance = 0.04 + 0.96 * (grazing * grazing) * (grazing * grazing) * grazing;
        let lamp = smoothstep(0.90, 0.97, mirrored.dot(self.light));
        let studio = vec3(0.20, 0.18, 0.17).lerp(vec3(0.75, 0.8, 0.9), smoothstep(-0.3, 0.9, mirrored.y));
        diffuse + (studio + LIGHT * (lamp * 14.0)) * reflectance
    }

    /// Where the light through a point falls on the floor.
    fn on_floor(&self, point: Vec3, light: Vec3) -> Vec3 {
        point - light * ((point.y - self.floor) / light.y)
    }
}

const IVORY: Vec3 = vec3(0.70, 0.65, 0.55);
const TEAL: Vec3 = vec3(0.02, 0.20, 0.23);
const LIGHT: Vec3 = vec3(1.0, 0.93, 0.82);
const FLOOR: Vec3 = vec3(0.62, 0.60, 0.58);

/// What is interpolated: position and normal in world space, and texture coordinates.
type Surfel = (Vec3, Vec3, Vec2);

/// How much of the light is hidden from each part of the floor around the origin.
struct Shadow {
    hidden: Vec<f32>,
}

impl Shadow {
    const SIZE: u32 = 256;
    /// From its middle to each side, in radii of the model.
    const REACH: f32 = 3.0;

    /// Draws the model's shadow from many points of the light, one over the other.
    fn new(scene: &Scene, mesh: &Mesh) -> Result<Self, Box<dyn Error>> {
        // Fewer points for large models, so that the shadow takes little longer than the picture.
        let lights = (4_000_000 / mesh.triangles().max(1)).clamp(4, 32);
        let rasterizer = Rasterizer::<()>::new(Viewport::of_size(Self::SIZE, Self::SIZE)?);
        let indices = Primitives::list().indexed(&mesh.indices);
        // How many points are hidden, and which was the last one of them: no point counts twice.
        let mut counts = vec![(0.0, 0); (Self::SIZE * Self::SIZE) as usize];
        let mut room = vec![ProjectedVertex::default(); mesh.positions.len()];
        let mut surface = Surface::color_only(&mut counts, Self::SIZE, Self::SIZE)?;
        let bar = progress("shadow");
        for i in bar.wrap_iter(1..=lights) {
            // Points on a sunflower's disc.
            let angle = i as f32 * 2.399_963;
            let radius = 0.28 * ((i as f32 - 0.5) / lights as f32).sqrt();
            let [right, up] = scene.light_across;
            let light = unit(scene.light + (right * angle.cos() + up * angle.sin()) * radius);
            let positions = Computed::new(mesh.positions.len(), |vertex| {
                let at = scene.on_floor(mesh.positions[vertex], light) / Self::REACH;
                Vec4::new(at.x, at.z, 0.0, 1.0)
            });
            let vertices = rasterizer.project(positions, &mut room)?;
            rasterizer.draw_over(&mut surface, indices, vertices, (), |_, (count, last)| {
                (count + if last == i { 0.0 } else { 1.0 }, i)
            })?;
        }
        bar.finish_and_clear();
        let mut hidden: Vec<f32> = counts.into_iter().map(|(count, _)| count / lights as f32).collect();
        // Blend the points' shadows into one another, along rows and then along columns.
        let size = Self::SIZE as usize;
        for step in [1, size] {
            let sharp = hidden.clone();
            for i in 3 * size + 3..hidden.len() - (3 * size + 3) {
                hidden[i] = (0..7).map(|k| sharp[i + k * step - 3 * step]).sum::<f32>() / 7.0;
            }
        }
        Ok(Self { hidden })
    }

    /// Between the four nearest texels.
    fn at(&self, point: Vec3) -> f32 {
        let size = Self::SIZE as f32;
        let texel = |coordinate: f32| (coordinate / Self::REACH + 1.0) * 0.5 * size - 0.5;
        let (u, v) = (texel(point.x), size - 1.0 - texel(point.z));
        let (x, y) = (floor_to_i32(u), floor_to_i32(v));
        let hidden = |x: i32, y: i32| {
            let is_inside = (0..Self::SIZE as i32).contains(&x) && (0..Self::SIZE as i32).contains(&y);
            if is_inside { self.hidden[y as usize * Self::SIZE as usize + x as usize] } else { 0.0 }
        };
        let row = |y| hidden(x, y) + (hidden(x + 1, y) - hidden(x, y)) * (u - x as f32);
        row(y) + (row(y + 1) - row(y)) * (v - y as f32)
    }
}

/// Linear light, `samples` × `samples` a pixel.
struct Picture {
    width: u32,
    height: u32,
    samples: u32,
    viewport: Viewport,
    light: Vec<Vec3>,
    depth: Vec<f32>,
}

impl Picture {
    fn new(width: u32, height: u32, samples: u32) -> Result<Self, Box<dyn Error>> {
        let (width, height) = (width * samples, height * samples);
        let viewport = Viewport::of_size(width, height)?;
        let light = (0..width * height).map(|i| background((i / width) as f32 / height as f32));
        let depth = vec![1.0; width as usize * height as usize];
        Ok(Self { width, height, samples, viewport, light: light.collect(), depth })
    }

    fn aspect(&self) -> f32 {
        self.width as f32 / self.height as f32
    }

    /// A disc of floor that fades into the background.
    fn draw_floor(&mut self, scene: &Scene, shadow: &Shadow) -> Result<Statistics, Box<dyn Error>> {
        const SIZE: f32 = 8.0;
        let corners = [(-SIZE, SIZE), (SIZE, SIZE), (-SIZE, -SIZE), (SIZE, -SIZE)]
            .map(|(x, z)| vec3(x, scene.floor, z));
        let positions = corners.map(|corner| scene.world_to_clip * corner.extend(1.0));
        let mut rasterizer = Rasterizer::<Vec3>::new(self.viewport);
        rasterizer.cull_mode = CullMode::Back; // from below, the floor hides nothing
        rasterizer.depth_clip = DepthClip::Clamp; // the near and far planes are as close as the model allows
        let mut target = Surface::color_only(&mut self.light, self.width, self.height)?;
        let drawn = rasterizer.draw(&mut target, Primitives::strip(), &positions, &corners, |fragment| {
            let position = fragment.varyings();
            let distance = vec3(position.x, 0.0, position.z).length_squared().sqrt();
            let behind = background((fragment.y() as f32 + 0.5) / self.height as f32);
            let fade = 1.0 - smoothstep(0.5, 4.5, distance);
            let light = 1.0 - 0.75 * shadow.at(position);
            behind.lerp(FLOOR, fade) * light
        })?;
        Ok(drawn)
    }

    fn draw_mesh(&mut self, scene: &Scene, mesh: &Mesh) -> Result<Statistics, Box<dyn Error>> {
        /// Triangles between two movements of the progress bar.
        const BATCH: usize = 1 << 18;
        let rasterizer = Rasterizer::<Surfel>::new(self.viewport);
        let mut target = Surface::new(&mut self.light, &mut self.depth, self.width, self.height)?;

        // The vertex shader. Each vertex is shared by six triangles, so project it once.
        let to_clip = |i: usize| scene.world_to_clip * mesh.positions[i].extend(1.0);
        let mut room = vec![ProjectedVertex::default(); mesh.positions.len()];
        let vertices = rasterizer.project(Computed::new(mesh.positions.len(), to_clip), &mut room)?;
        let varyings = (&mesh.positions[..], &mesh.normals[..], &mesh.uvs[..]);

        let bar = progress("drawing");
        bar.set_length(mesh.triangles() as u64);
        let mut statistics = Statistics::default();
        for batch in mesh.indices.chunks(3 * BATCH) {
            let triangles = Primitives::list().indexed(batch);
            statistics += rasterizer
                .draw(&mut target, triangles, vertices, varyings, |fragment| scene.shade_mesh(fragment))?;
            bar.inc(batch.len() as u64 / 3);
        }
        bar.finish_and_clear();
        Ok(statistics)
    }

    /// The mean of each pixel's samples.
    fn resolve(&self) -> Vec<u32> {
        let (samples, width) = (self.samples as usize, self.width as usize);
        let mut pixels = Vec::with_capacity(self.light.len() / (samples * samples));
        for rows in self.light.chunks(width * samples) {
            pixels.extend((0..width).step_by(samples).map(|x| {
                let light = rows.chunks(width).flat_map(|row| &row[x..x + samples]);
                let sum: Vec3 = light.map(|light| light.min(Vec3::ONE)).sum();
                image::encode(sum / (samples * samples) as f32)
            }));
        }
        pixels
    }
}

/// From the top, 0, to the bottom, 1.
fn background(y: f32) -> Vec3 {
    vec3(0.22, 0.27, 0.33).lerp(vec3(0.60, 0.58, 0.56), smoothstep(0.0, 1.0, y))
}
