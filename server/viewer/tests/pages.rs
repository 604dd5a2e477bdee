//! The pages, as a browser gets them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on ends")]

use axum::body::{Body, to_bytes};
use axum::http::{Request, StatusCode, header};
use sinew_viewer::{Config, Viewer};
use tower::ServiceExt as _;

async fn get(path: &str) -> axum::response::Response {
    let viewer = Viewer::start(Config::default()).unwrap();
    let request = Request::get(path).body(Body::empty()).unwrap();
    viewer.pages().oneshot(request).await.unwrap()
}

async fn text(path: &str) -> String {
    let response = get(path).await;
    assert_eq!(response.status(), StatusCode::OK, "{path}");
    let bytes = to_bytes(response.into_body(), 1 << 20).await.unwrap();
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// What a page loads, by its `src` and `href` attributes.
fn loads(html: &str) -> Vec<&str> {
    let attributes = ["src=\"", "href=\""];
    let values = attributes.iter().flat_map(|a| html.split(a).skip(1));
    values.map(|rest| rest.split('"').next().unwrap()).collect()
}

#[tokio::test]
async fn pages_load_from_this_server_only_and_all_that_they_load_is_there() {
    for page in ["/", "/sessions/bar"] {
        let html = text(page).await;
        assert!(
            !html.contains("<style") && !html.contains(" style="),
            "{page} has styles inline"
        );
        for path in loads(&html) {
            assert!(path.starts_with('/'), "{page} loads {path}");
            assert_eq!(
                get(path).await.status(),
                StatusCode::OK,
                "{page} loads {path}"
            );
        }
    }
}

#[tokio::test]
async fn every_answer_carries_the_policy() {
    for path in [
        "/",
        "/sessions/bar",
        "/pages/session.js",
        "/pages/style.css",
    ] {
        let response = get(path).await;
        let policy = response.headers()[header::CONTENT_SECURITY_POLICY]
            .to_str()
            .unwrap();
        for rule in [
            "default-src 'none'",
            "connect-src 'self'",
            "frame-ancestors 'none'",
        ] {
            assert!(policy.contains(rule), "{path}: {policy}");
        }
        assert!(!policy.contains("'unsafe-"), "{path}: {policy}");
        assert_eq!(response.headers()[header::REFERRER_POLICY], "same-origin");
    }
}

#[cfg(feature = "web")]
#[tokio::test]
async fn the_sessions_page_names_the_viewer_that_is_served_compressed_and_for_ever() {
    let script = text("/pages/session.js").await;
    let folder = script.split("const VIEWER = \"").nth(1).unwrap();
    let folder = folder.split('"').next().unwrap();
    for (file, kind) in [
        ("viewer.js", "text/javascript"),
        ("viewer.wasm", "application/wasm"),
    ] {
        let response = get(&format!("{folder}/{file}")).await;
        assert_eq!(response.status(), StatusCode::OK, "{file}");
        let header = |name| response.headers()[name].to_str().unwrap();
        assert!(header(header::CONTENT_TYPE).starts_with(kind));
        assert_eq!(header(header::CONTENT_ENCODING), "gzip");
        assert!(header(header::CACHE_CONTROL).contains("immutable"));
    }
}
