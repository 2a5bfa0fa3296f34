//! A picture larger than memory: 16 384 × 16 384 pixels, 2 GiB with their depths, in less than 64 MiB.
//!
//! Geometry is prepared once, and binned by bands of the picture. Band after band is then drawn by all threads and goes
//! into the PNG encoder, which writes it away.
//!
//! ```text
//! cargo run --release --example poster              2048 × 2048
//! cargo run --release --example poster -- --full    16384 × 16384
//! ```

mod support;

use clap::Parser;
use core::error::Error;
use halfplane::{Grid, Primitives, ProjectedVertex, Record, Rect, Surface};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use std::{fs, io, io::Write, path::PathBuf};
use support::scene;

/// How many bands are in memory at a time, and how many rows each of them has.
const BANDS: usize = 4;
const ROWS: u32 = 8;

/// Draws a large teapot to a PNG file.
#[derive(Debug, Parser)]
struct Options {
    /// 16384 × 16384 pixels
    #[arg(long)]
    full: bool,
    /// The picture's width and height
    #[arg(long, default_value_t = 2048, value_parser = clap::value_parser!(u32).range(1..=16384))]
    size: u32,
    /// Cells along each side of each of the teapot's 32 patches
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..=100))]
    level: u32,
    /// Where to write the picture
    #[arg(long, short, default_value = "target/examples-output/poster.png")]
    output: PathBuf,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let size = if options.full { 16_384 } else { options.size };
    let scene = scene::Scene::teapot(options.level, 1.0);

    // Geometry.
    let rasterizer = scene.rasterizer(size, size)?;
    let frame = Rect::of_size(size, size);
    let bands = Grid::new(frame, size, ROWS)?;
    let mut room = vec![ProjectedVertex::default(); scene.positions.len()];
    let vertices = rasterizer.project(&scene.positions[..], &mut room)?;
    let primitives = Primitives::list().indexed(&scene.indices);
    let mut records = vec![Record::default(); scene.indices.len() / 3];
    let mut preparation = rasterizer.prepare(frame, primitives, vertices, &scene.values[..])?;
    let batch = preparation.fill(&mut records)?.unwrap_or_default();
    let mut memory = vec![0; Grid::bin_memory(bands.len(), bands.len().max(8 * batch.len()))];
    let bins = rasterizer.bin(&bands, batch, &mut memory)?;
    let entries = bins.entries();
    println!(
        "{} triangles of {} may be seen; {entries} entries in {} bands",
        batch.len(),
        scene.indices.len() / 3,
        bands.len()
    );

    // Fragments.
    if let Some(directory) = options.output.parent() {
        fs::create_dir_all(directory)?;
    }
    let file = io::BufWriter::new(fs::File::create(&options.output)?);
    let mut encoder = png::Encoder::new(file, size, size);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;

    let style = ProgressStyle::with_template("{wide_bar} {percent}% {eta}")?;
    let bar = ProgressBar::new(bands.len() as u64).with_style(style);
    let len = bands.tile_len();
    let (mut color, mut depth) = (vec![0u32; BANDS * len], vec![0.0f32; BANDS * len]);
    let mut row = vec![0; size as usize * 3];
    let (mut fragments, mut compared) = (0, 0);
    for first in (0..bands.len()).step_by(BANDS) {
        color.fill(scene::BACKGROUND);
        depth.fill(1.0);
        let memory = color.par_chunks_mut(len).zip(depth.par_chunks_mut(len)).enumerate();
        fragments += memory
            .filter_map(|(band, (color, depth))| {
                let area = bands.tile(first + band)?;
                let mut band_surface = Surface::with_planes(color, depth, area, size as usize).ok()?;
                let records = bins.tile(first + band).chain(bins.rest());
                let shade = |fragment: halfplane::Fragment<'_, _>| scene::color(fragment.varyings());
                Some(rasterizer.draw_prepared(&mut band_surface, records, shade).fragments)
            })
            .sum::<u64>();
        let left = size as usize - first * ROWS as usize;
        let rows = color.chunks(size as usize).take(left);
        for pixels in rows {
            for (rgb, pixel) in row.chunks_exact_mut(3).zip(pixels) {
                rgb.copy_from_slice(&pixel.to_le_bytes()[..3]);
            }
            stream.write_all(&row)?;
        }
        // Now and then a look at a few pixels, drawn all by themselves.
        if first / BANDS % 16 == 7 {
            let area = Rect {
                x: size as i32 / 2 - 5,
                y: (u32::try_from(first).expect("few bands") * ROWS) as i32,
                width: 100.min(size / 2),
                height: ROWS,
            };
            compared += compare(&scene, &rasterizer, area, size, &color)?;
        }
        bar.inc(BANDS.min(bands.len() - first) as u64);
    }
    stream.finish()?;
    writer.finish()?;
    bar.finish_and_clear();
    println!("{fragments} fragments; {compared} pixels compared with a draw of their own");
    println!("wrote {} ({size}x{size})", options.output.display());
    if let Some(peak) = peak_memory() {
        println!("at most {peak:.1} MiB of memory");
        assert!(peak < 64.0, "less than 64 MiB");
    }
    Ok(())
}

/// Draws some pixels alone, in one go, and finds them in the picture's rows.
fn compare(
    scene: &scene::Scene,
    rasterizer: &halfplane::Rasterizer<scene::Lit>,
    area: Rect,
    size: u32,
    rows: &[u32],
) -> Result<usize, Box<dyn Error>> {
    let len = (area.width * area.height) as usize;
    let (mut color, mut depth) = (vec![scene::BACKGROUND; len], vec![1.0f32; len]);
    let mut target = Surface::with_planes(&mut color[..], &mut depth[..], area, area.width as usize)?;
    let primitives = Primitives::list().indexed(&scene.indices);
    rasterizer.draw(&mut target, primitives, &scene.positions[..], &scene.values[..], |fragment| {
        scene::color(fragment.varyings())
    })?;
    for (alone, row) in color.chunks(area.width as usize).zip(rows.chunks(size as usize)) {
        let start = area.x as usize;
        assert!(alone == &row[start..start + alone.len()], "the picture does not depend on how it is cut");
    }
    Ok(len)
}

/// The most memory that this process ever had, in MiB, where the system tells.
fn peak_memory() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? / 1024.0)
}
