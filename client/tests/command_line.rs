//! The binary `sinew` as a shell sees it.

#![cfg(feature = "cli")]

use std::process::{Command, Stdio};

#[test]
fn a_reader_that_leaves_ends_a_command_quietly() {
    let walk = concat!(env!("CARGO_MANIFEST_DIR"), "/demo/walk.bvh");
    for arguments in [&["completions", "bash"][..], &["inspect", "--json", walk]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sinew"));
        command.args(arguments).stdout(Stdio::piped());
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {errors}");
        assert!(!errors.contains("panicked"), "{arguments:?}: {errors}");
    }
}

#[test]
fn inspecting_a_cloud_of_points_tells_its_spacing_and_what_is_wrong() {
    let octopus = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/scenes/elastic/clouds/octopus.ply"
    );
    let bars = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/scenes/elastic/clouds/bars-2d.csv"
    );
    let said = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sinew"));
        let output = command.arg("inspect").args(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let text = said(&[octopus]);
    assert!(text.contains("PLY") && text.contains("8,267"), "{text}");
    assert!(
        !text.contains("outliers") && !text.contains("in one place"),
        "{text}"
    );
    let json: serde_json::Value =
        serde_json::from_str(&said(&["--cloud", "--json", bars])).unwrap();
    assert_eq!(
        (&json["points"], &json["plane"]),
        (&2_220.into(), &true.into())
    );
    assert_eq!(json["pieces"], serde_json::json!([2_220]));
    let far = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("far.csv");
    let near = (0..60).map(|i| format!("{},{},0\n", i % 10, i / 10));
    std::fs::write(
        &far,
        near.chain(["90,0,0\n".to_owned()]).collect::<String>(),
    )
    .unwrap();
    let text = said(&["--cloud", far.to_str().unwrap()]);
    assert!(
        text.contains("outliers") && text.contains("60: they hold to nothing"),
        "{text}"
    );
}
