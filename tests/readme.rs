//! The README says what is true.

const README: &str = include_str!("../README.md");

/// The first program that a newcomer reads stands in three places: here, on the crate's front page (which includes the
/// file) and in `examples/`.
#[test]
fn the_program_in_the_readme_is_the_example() {
    let example = include_str!("../examples/hello_triangle.rs");
    assert!(README.contains(&format!("```rust\n{example}```")), "README.md and hello_triangle.rs differ");
}

#[test]
fn every_test_that_the_readme_names_exists() {
    let files = [
        ("laws_coverage.rs", include_str!("laws_coverage.rs")),
        ("laws_cutting.rs", include_str!("laws_cutting.rs")),
        ("laws_clipping.rs", include_str!("laws_clipping.rs")),
    ];
    for (file, name) in [
        ("laws_coverage.rs", "every_sample_under_a_mesh_is_drawn_once"),
        ("laws_cutting.rs", "picture_does_not_depend_on_how_the_frame_is_cut_into_tiles"),
        ("laws_cutting.rs", "the_order_of_vertices_changes_no_bit"),
        ("laws_clipping.rs", "a_clipped_mesh_is_watertight"),
        ("laws_clipping.rs", "clipping_changes_coverage_only_at_edges"),
    ] {
        assert!(README.contains(name), "{name} is not in the README: change this test");
        let text = files.iter().find(|(other, _)| *other == file).map_or("", |(_, text)| *text);
        assert!(text.contains(&format!("fn {name}(")), "the README names {name}, which is not in {file}");
    }
}
