//! halfplane and its peers draw the same workloads, turn by turn, on one core.
//!
//! ```text
//! cargo run --release --manifest-path benches/peers/Cargo.toml -- --workloads W1,W3 --dump target/pictures
//! ```
//!
//! For each workload every contestant draws one frame, then every one the next, and so on: what the machine
//! does meanwhile hits all alike. Time is CPU time of the drawing thread, because a busy machine would inflate wall
//! time; `--clock wall` measures that instead. Clearing is not timed. It prints one table of medians, then how far each
//! picture is from the first contestant's, and fails when one is too far. OpenGL needs an EGL library on the
//! machine (Debian: `apt-get install libegl1 libgl1-mesa-dri`); without one a line says why it is missing.

mod clock;
mod contestant;
mod euc;
mod frame;
mod halfplane;
mod naive;
mod opengl;
mod picture;
mod retrofire;
#[path = "../../../examples/support"]
mod support {
    #![allow(
        dead_code,
        clippy::manual_is_multiple_of,
        reason = "written for the examples, and for Rust 1.85"
    )]
    pub mod mesh;
    pub mod teapot;
}
#[path = "../../workloads/draw.rs"]
mod draw;
#[path = "../../workloads/mod.rs"]
mod workloads;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;

use clock::Clock;
use contestant::Contestant;
use frame::PIXELS;
use picture::{MAY_DIFFER, Picture};
use workloads::Workload;

/// Cells along each side of the teapot's patches: 102 080 triangles.
const TEAPOT_LEVEL: u32 = 40;

/// Compares rasterizers on the same workloads: median milliseconds a frame, on one core.
#[derive(Parser)]
struct Options {
    /// Workloads to draw, such as W1,W3; all by default.
    #[arg(long, value_delimiter = ',')]
    workloads: Vec<String>,

    /// Frames that each contestant draws of each workload.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,

    /// Contestants, by the beginnings of their names, such as llvmpipe,euc; all by default.
    #[arg(long, value_delimiter = ',')]
    contestants: Vec<String>,

    /// Which time to measure.
    #[arg(long, value_enum, default_value_t = Clock::Cpu)]
    clock: Clock,

    /// Writes each picture into this directory as a PNG.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
}

/// One contestant at one workload.
struct Entry {
    /// Milliseconds.
    median: f64,
    /// Pixels unlike the reference's.
    differing: usize,
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let options = Options::parse();
    if let Some(core) = core_affinity::get_core_ids().and_then(|cores| cores.last().copied()) {
        core_affinity::set_for_current(core);
    }
    let mut contestants = contestants(&options.contestants);
    let workloads: Vec<_> = if options.workloads.is_empty() {
        Workload::NAMES.map(String::from).to_vec()
    } else {
        options.workloads.clone()
    };
    if let Some(directory) = &options.dump {
        std::fs::create_dir_all(directory)?;
    }

    let mut rows = Vec::new();
    for name in &workloads {
        let workload = Workload::new(name, teapot).ok_or_else(|| {
            format!("no workload is called {name}; there are {}", Workload::NAMES.join(", "))
        })?;
        eprintln!("{name}: {}", workload.what);
        let row = compete(&workload, &mut contestants, &options)?;
        rows.push((workload, row));
    }
    let dispatched = if cfg!(feature = "dispatch") { "; halfplane is dispatched" } else { "" };
    println!(
        "Medians of {} frames, {}; built for {}{}.\n",
        options.frames,
        options.clock.what(),
        features(),
        dispatched
    );
    print_table(&contestants, &rows);
    Ok(if print_differences(&contestants, &rows) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The mesh of W6.
fn teapot() -> workloads::Mesh {
    let support::mesh::Mesh { positions, normals, uvs, indices } =
        support::teapot::tessellate(TEAPOT_LEVEL, |_, _| {});
    workloads::Mesh { positions, normals, uvs, indices }
}

/// All contestants that are here and whose name was asked for.
fn contestants(wanted: &[String]) -> Vec<Box<dyn Contestant>> {
    let is_wanted =
        |name: &str| wanted.is_empty() || wanted.iter().any(|wanted| name.starts_with(wanted.as_str()));
    let mut all: Vec<Box<dyn Contestant>> = Vec::new();
    all.push(Box::new(halfplane::Halfplane::new()));
    match opengl::OpenGl::new() {
        Ok(opengl) => all.push(Box::new(opengl)),
        Err(why) => println!("OpenGL is not here: {why}\n"),
    }
    all.push(Box::new(retrofire::Retrofire::new()));
    all.push(Box::new(euc::Euc::new()));
    all.push(Box::new(naive::Naive::new()));
    all.retain(|contestant| is_wanted(contestant.name()));
    all
}

/// Draws all frames of one workload; `None` for those who can't.
fn compete(
    workload: &Workload,
    contestants: &mut [Box<dyn Contestant>],
    options: &Options,
) -> Result<Vec<Option<Entry>>, Box<dyn Error>> {
    let mut times = vec![Vec::new(); contestants.len()];
    for contestant in contestants.iter_mut().filter(|contestant| contestant.supports(workload)) {
        contestant.prepare(workload);
    }
    // One frame more than is counted: the first one warms caches, pages and shader compilers.
    for frame in 0..=options.frames {
        for (contestant, times) in contestants.iter_mut().zip(&mut times) {
            if !contestant.supports(workload) {
                continue;
            }
            contestant.clear();
            let start = options.clock.now();
            contestant.draw(workload);
            let elapsed = options.clock.now() - start;
            if frame > 0 {
                times.push(elapsed);
            }
        }
    }

    let mut reference: Option<Picture> = None;
    let mut row = Vec::new();
    for (contestant, mut times) in contestants.iter_mut().zip(times) {
        if times.is_empty() {
            row.push(None);
            continue;
        }
        times.sort_by(f64::total_cmp);
        let picture = Picture::read(contestant.as_mut(), workload);
        if let Some(directory) = &options.dump {
            let contestant = contestant.name().replace(' ', "_");
            picture.save(&directory.join(format!("{}-{contestant}.png", workload.name)))?;
        }
        let differing = reference.as_ref().map_or(0, |reference| picture.differing(reference));
        row.push(Some(Entry { median: times[times.len() / 2], differing }));
        reference.get_or_insert(picture);
    }
    Ok(row)
}

/// What of the processor the compiler was allowed to use.
fn features() -> &'static str {
    if cfg!(target_feature = "avx512f") {
        "AVX-512"
    } else if cfg!(target_feature = "avx2") {
        "AVX2"
    } else {
        "its target's least processor"
    }
}

/// Medians, and in brackets how many times the first contestant's.
fn print_table(contestants: &[Box<dyn Contestant>], rows: &[(Workload, Vec<Option<Entry>>)]) {
    let names: Vec<_> = contestants.iter().map(|contestant| contestant.name()).collect();
    println!("| ms (× the first) | {} |", names.join(" | "));
    println!("| --- |{}", " ---: |".repeat(names.len()));
    for (workload, row) in rows {
        let first = row.first().and_then(Option::as_ref);
        let cell = |entry: &Option<Entry>| match (entry, first) {
            (None, _) => "-".to_owned(),
            (Some(entry), None) => format!("{:.2}", entry.median),
            (Some(entry), Some(first)) => format!("{:.2} ({:.2})", entry.median, entry.median / first.median),
        };
        let cells: Vec<_> = row.iter().map(cell).collect();
        println!("| {} {} | {} |", workload.name, workload.what, cells.join(" | "));
    }
}

/// Tells how many pixels are unlike the first contestant's; whether all are near enough.
fn print_differences(contestants: &[Box<dyn Contestant>], rows: &[(Workload, Vec<Option<Entry>>)]) -> bool {
    let allowed = (MAY_DIFFER * PIXELS as f64) as usize;
    println!();
    println!("Pixels unlike the first contestant's by more than 8 of 255 (at most {allowed} may be):");
    let mut all_agree = true;
    for (i, contestant) in contestants.iter().enumerate() {
        let counts: Vec<_> = rows
            .iter()
            .filter_map(|(workload, row)| row[i].as_ref().map(|entry| (workload.name, entry.differing)))
            .map(|(name, differing)| {
                format!("{name} {differing}{}", if differing > allowed { " (!)" } else { "" })
            })
            .collect();
        let counts_line = if counts.is_empty() { "nothing drawn".to_owned() } else { counts.join(", ") };
        println!("* {}: {counts_line}", contestant.name());
        all_agree &= counts.iter().all(|count| !count.ends_with("(!)"));
    }
    all_agree
}
