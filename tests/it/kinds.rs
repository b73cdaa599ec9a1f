//! A point is one kind of measurement among others: who needs one asks for it by `Measurements::point`, and counts rows, not points.

use crate::source::files;
use std::fs;
use std::path::Path;

/// Where points, and positions of joints that move, are arrays.
fn may_index(file: &str) -> bool {
    file.ends_with("/point.rs")
        || file == "numerics/robot/readings.rs"
        || file.starts_with("twin/")
        || file.starts_with("numerics/dynamics/")
}

/// Lines of a text that index points or count them.
fn indexed(text: &str) -> Vec<usize> {
    let is = |line: &&str| {
        [".position[", ".position.len()"]
            .iter()
            .any(|word| line.contains(word))
    };
    (1..)
        .zip(text.lines())
        .filter(|(_, line)| is(line))
        .map(|(number, _)| number)
        .collect()
}

#[test]
fn points_are_indexed_in_files_of_their_own_alone() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut faults = Vec::new();
    for path in files(&root) {
        let file = path
            .strip_prefix(&root)
            .unwrap()
            .to_string_lossy()
            .replace('\\', "/");
        if !may_index(&file) {
            let lines = indexed(&fs::read_to_string(&path).unwrap());
            faults.extend(lines.into_iter().map(|line| format!("src/{file}:{line}")));
        }
    }
    assert_eq!(
        faults,
        Vec::<String>::new(),
        "ask for `point(row)`, which is none where a row measured something else"
    );
}

#[test]
fn an_index_and_a_count_of_points_are_found() {
    let text = "let p = data.points.position[row];\nlet n = names.iter().position(|x| x == y);\nlet rows = data.position.len();\n";
    assert_eq!(indexed(text), [1, 3]);
}
