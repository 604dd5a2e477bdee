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
