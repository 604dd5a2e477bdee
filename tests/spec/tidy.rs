//! Rules that no compiler checks.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use prost::Message as _;
use prost_types::{DescriptorProto, FileDescriptorProto, FileDescriptorSet, MethodDescriptorProto};

/// Most lines of a file.
const LINES: usize = 500;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_owned()
}

/// The files below a folder whose names end so. What is generated, downloaded or hidden is left out.
fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap();
            if path.is_dir() {
                if !(name.starts_with('.') || matches!(name, "target" | "node_modules")) {
                    folders.push(path);
                }
            } else if path
                .extension()
                .is_some_and(|e| extensions.iter().any(|x| e == *x))
            {
                found.push(path);
            }
        }
    }
    assert!(
        !found.is_empty(),
        "{} holds none of {extensions:?}",
        folder.display()
    );
    found.sort();
    found
}

fn relative(path: &Path) -> &Path {
    path.strip_prefix(root()).unwrap()
}

#[test]
fn no_file_is_too_long_to_be_read_at_once() {
    let mut long = Vec::new();
    for path in files(&root(), &["rs", "proto"]) {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        if lines > LINES {
            long.push(format!("{} has {lines} lines", relative(&path).display()));
        }
    }
    assert!(long.is_empty(), "more than {LINES} lines: {long:#?}");
}

/// A letter and digits, such as `P1`.
fn is_tag(text: &str) -> bool {
    let Some((letter, digits)) = text.split_at_checked(1) else {
        return false;
    };
    letter.bytes().all(|b| b.is_ascii_uppercase())
        && !digits.is_empty()
        && digits.bytes().all(|b| b.is_ascii_digit())
}

/// The tags in brackets, such as `[P1]`, in the comments of a source file.
fn tags(source: &str) -> BTreeSet<String> {
    let comments = source.lines().filter_map(|line| line.split_once("//"));
    let brackets = comments.flat_map(|(_, comment)| {
        let opened = comment.split('[').skip(1);
        opened.filter_map(|rest| rest.split_once(']'))
    });
    let inside = brackets.map(|(inside, _)| inside);
    inside
        .filter(|inside| is_tag(inside))
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_equations_in_the_code_and_in_the_ledger_are_the_same() {
    let mut in_code = BTreeSet::new();
    for path in files(&root().join("server"), &["rs"]) {
        in_code.append(&mut tags(&fs::read_to_string(path).unwrap()));
    }
    let ledger = fs::read_to_string(root().join("EQUATIONS.md")).unwrap();
    let first_cells = ledger
        .lines()
        .filter_map(|line| line.strip_prefix('|')?.split('|').next());
    let rows: Vec<&str> = first_cells
        .map(str::trim)
        .filter(|cell| is_tag(cell))
        .collect();
    let in_ledger: BTreeSet<String> = rows.iter().map(|tag| (*tag).to_owned()).collect();
    assert_eq!(rows.len(), in_ledger.len(), "a tag has two rows");
    let unknown: Vec<_> = in_code.difference(&in_ledger).collect();
    let unused: Vec<_> = in_ledger.difference(&in_code).collect();
    assert!(
        unknown.is_empty(),
        "in the code, not in the ledger: {unknown:?}"
    );
    assert!(
        unused.is_empty(),
        "in the ledger, not in the code: {unused:?}"
    );
    assert!(!in_code.is_empty());
}

#[test]
fn kernels_depend_on_nothing_that_waits_serves_or_shows() {
    let outside = [
        "bytemuck",
        "kiddo",
        "multiversion",
        "nalgebra",
        "rayon",
        "thiserror",
        "xxhash-rust",
    ];
    for path in files(&root().join("server"), &["toml"]) {
        let manifest: toml::Table = fs::read_to_string(&path).unwrap().parse().unwrap();
        let kernel = manifest["package"]["name"].as_str().unwrap();
        if matches!(kernel, "sinew-server" | "sinew-viewer") {
            continue;
        }
        for name in manifest["dependencies"].as_table().unwrap().keys() {
            let binds_kernels =
                matches!(kernel, "sinew-engine" | "sinew-tearing") && name.starts_with("sinew-");
            let allowed = outside.contains(&name.as_str())
                || binds_kernels && !matches!(name.as_str(), "sinew-proto" | "sinew-viewer");
            assert!(allowed, "{kernel} depends on {name}");
        }
        for table in ["build-dependencies", "target"] {
            assert!(!manifest.contains_key(table), "{kernel} has {table}");
        }
    }
}

/// Whether code names a gRPC code, or makes a status by a constructor that chooses one.
fn chooses_a_code(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    let after = |name: &str, follows: fn(char) -> bool| {
        code.match_indices(name).any(|(at, _)| {
            let before = code[..at].chars().next_back();
            let whole = !before.is_some_and(|c| c.is_alphanumeric() || c == '_');
            whole && code[at + name.len()..].starts_with(follows)
        })
    };
    let conversion = ["Status::from", "Status::into"]
        .iter()
        .any(|name| code.contains(name));
    after("Code::", |c| c.is_ascii_uppercase())
        || code.contains("tonic::Code")
        || (after("Status::", |c| c.is_ascii_lowercase()) && !conversion)
}

#[test]
fn one_file_of_the_server_chooses_grpc_codes() {
    let mut choosers = Vec::new();
    for path in files(&root().join("server/src"), &["rs"]) {
        let source = fs::read_to_string(&path).unwrap();
        if source.lines().any(chooses_a_code) {
            choosers.push(relative(&path).to_owned());
        }
    }
    assert_eq!(choosers, [Path::new("server/src/status.rs")]);
}

/// The things of a file that have no comment, by their names. A request or a response is what its method says of it.
fn undocumented(file: &FileDescriptorProto) -> Vec<String> {
    let source = file.source_code_info.as_ref().unwrap();
    let documented = |path: &[i32]| {
        let mut locations = source
            .location
            .iter()
            .filter(|location| location.path == path);
        locations.any(|location| {
            let comments = [location.leading_comments(), location.trailing_comments()];
            comments.iter().any(|comment| !comment.trim().is_empty())
        })
    };
    let mut bare = Vec::new();
    let mut see = |path: &[i32], name: String| {
        if !documented(path) {
            bare.push(name);
        }
    };
    // Numbers of the fields in descriptor.proto: 4 messages (2 their fields), 5 enums (2 values), 6 services (2 methods).
    for (i, message) in (0..).zip(&file.message_type) {
        let DescriptorProto {
            nested_type,
            enum_type,
            ..
        } = message;
        assert!(
            nested_type.is_empty() && enum_type.is_empty(),
            "look into {}",
            message.name()
        );
        if !(message.name().ends_with("Request") || message.name().ends_with("Response")) {
            see(&[4, i], message.name().to_owned());
        }
        for (j, field) in (0..).zip(&message.field) {
            see(
                &[4, i, 2, j],
                format!("{}.{}", message.name(), field.name()),
            );
        }
    }
    for (i, kind) in (0..).zip(&file.enum_type) {
        see(&[5, i], kind.name().to_owned());
        for (j, value) in (0..).zip(&kind.value) {
            see(&[5, i, 2, j], value.name().to_owned());
        }
    }
    for (i, service) in (0..).zip(&file.service) {
        see(&[6, i], service.name().to_owned());
        for (j, method) in (0..).zip(&service.method) {
            see(
                &[6, i, 2, j],
                format!("{}.{}", service.name(), method.name()),
            );
        }
    }
    bare
}

fn api() -> Vec<FileDescriptorProto> {
    let set = FileDescriptorSet::decode(sinew_proto::DESCRIPTORS).unwrap();
    let ours = set
        .file
        .into_iter()
        .filter(|file| file.package() == "sinew.v1");
    ours.collect()
}

#[test]
fn everything_in_the_api_is_documented() {
    let bare: Vec<_> = api().iter().flat_map(undocumented).collect();
    assert!(bare.is_empty(), "without a comment: {bare:#?}");
}

#[test]
fn every_method_has_a_request_of_its_own_name() {
    for file in api() {
        for method in file.service.iter().flat_map(|service| &service.method) {
            let MethodDescriptorProto { input_type, .. } = method;
            let expected = format!(".sinew.v1.{}Request", method.name());
            assert_eq!(input_type.as_deref(), Some(expected.as_str()));
        }
    }
}
