//! Colours in and PNG files out.
//!
//! Pixels are what `halfplane::pack_srgba8` makes: RGBA8 in one `u32`, red in the low byte, `0xAABBGGRR`.

use halfplane::{glam::Vec3, pack_rgba8, pack_srgba8, unpack_srgba8};
use std::{fs, io, path::Path, path::PathBuf};

/// The linear light that an sRGB value in [0, 1] stands for, to the nearest of 256: what shading computes with.
pub fn srgb_to_linear(srgb: Vec3) -> Vec3 {
    unpack_srgba8(pack_rgba8(srgb.extend(1.0))).truncate()
}

/// An opaque pixel that shows linear light.
pub fn encode(linear: Vec3) -> u32 {
    pack_srgba8(linear.extend(1.0))
}

/// Where an example writes: the path that is its first argument, or `target/examples-output/NAME.png`.
pub fn output_path(name: &str) -> PathBuf {
    match std::env::args_os().nth(1) {
        Some(path) => path.into(),
        None => default_path(name),
    }
}

/// `target/examples-output/NAME.png` below the current directory, which git ignores already.
pub fn default_path(name: &str) -> PathBuf {
    PathBuf::from(format!("target/examples-output/{name}.png"))
}

/// Writes opaque or transparent `0xAABBGGRR` pixels, row by row from the top, and says where.
///
/// # Errors
///
/// Whatever the file system says, with the path in front.
///
/// # Panics
///
/// If `pixels` are not `width` × `height`.
pub fn write_png(path: &Path, width: u32, height: u32, pixels: &[u32]) -> io::Result<()> {
    let bytes: Vec<u8> = pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect();
    write(path, width, height, png::ColorType::Rgba, &bytes)
}

/// Writes one byte for each pixel, 255 white.
///
/// # Errors
///
/// Whatever the file system says, with the path in front.
///
/// # Panics
///
/// If `pixels` are not `width` × `height`.
pub fn write_png_gray(path: &Path, width: u32, height: u32, pixels: &[u8]) -> io::Result<()> {
    write(path, width, height, png::ColorType::Grayscale, pixels)
}

fn write(path: &Path, width: u32, height: u32, color: png::ColorType, bytes: &[u8]) -> io::Result<()> {
    assert_eq!(
        bytes.len(),
        width as usize * height as usize * color.samples(),
        "the pixels of a {width}x{height} picture"
    );
    let save = || -> io::Result<()> {
        if let Some(directory) = path.parent() {
            fs::create_dir_all(directory)?;
        }
        let mut encoder = png::Encoder::new(io::BufWriter::new(fs::File::create(path)?), width, height);
        encoder.set_color(color);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(bytes)?;
        Ok(writer.finish()?)
    };
    save().map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
    println!("wrote {} ({width}x{height})", path.display());
    Ok(())
}
