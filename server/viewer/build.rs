//! Compresses the browser's viewer once, here: the binary carries 14 MB of gzip and no compressor, and serving costs
//! nothing at start.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "web")]
    web::compress()?;
    Ok(())
}

#[cfg(feature = "web")]
mod web {
    use std::error::Error;
    use std::fs::File;
    use std::path::Path;
    use std::{env, io::Write as _};

    use flate2::Compression;
    use flate2::write::GzEncoder;
    use re_web_viewer_server::WebViewerData;

    pub(super) fn compress() -> Result<(), Box<dyn Error>> {
        let folder = env::var_os("OUT_DIR").ok_or("Cargo sets OUT_DIR")?;
        let data = WebViewerData::load(None)?;
        for (name, bytes) in [
            ("viewer.js.gz", data.viewer_js()),
            ("viewer.wasm.gz", data.viewer_wasm()),
        ] {
            let file = File::create(Path::new(&folder).join(name))?;
            let mut encoder = GzEncoder::new(file, Compression::default());
            encoder.write_all(bytes)?;
            encoder.finish()?;
        }
        Ok(())
    }
}
