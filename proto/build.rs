//! Compiles `sinew/v1` without a system `protoc`.

use std::{env, error::Error, fs, path::PathBuf};

use prost::Message as _;

const FILES: [&str; 12] = [
    "sinew/v1/asset.proto",
    "sinew/v1/data.proto",
    "sinew/v1/edit.proto",
    "sinew/v1/elastic.proto",
    "sinew/v1/event.proto",
    "sinew/v1/mapping.proto",
    "sinew/v1/mesh.proto",
    "sinew/v1/motion.proto",
    "sinew/v1/particles.proto",
    "sinew/v1/rule.proto",
    "sinew/v1/scene.proto",
    "sinew/v1/session.proto",
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=sinew");
    let descriptors = protox::compile(FILES, ["."])?;
    let encoded = descriptors.encode_to_vec();
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("descriptors.bin"), &encoded)?;
    tonic_prost_build::configure()
        .bytes(".")
        .compile_well_known_types(true)
        .extern_path(".google.protobuf", "::pbjson_types")
        .compile_fds(descriptors)?;
    pbjson_build::Builder::new()
        .register_descriptors(&encoded)?
        .build(&[".sinew.v1"])?;
    Ok(())
}
