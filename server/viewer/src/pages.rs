//! The pages: the list of sessions, and each session's live view.

use axum::Router;
use axum::http::HeaderValue;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
};
use axum::middleware;
use axum::response::{IntoResponse as _, Response};
use axum::routing::{MethodRouter, get};

/// Nothing but what we serve: no inline script or style, no other host. The viewer would send telemetry; `connect-src`
/// keeps it here. It needs wasm, makes style sheets and images of its own, and measures nothing else.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; \
     connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
);

/// Pages may change with the binary; they are small.
const ASK_AGAIN: &str = "no-cache";

pub(crate) fn router() -> Router {
    let pages = Router::new()
        .route(
            "/",
            page(
                "text/html; charset=utf-8",
                include_str!("../pages/list.html"),
            ),
        )
        .route(
            "/sessions/{id}",
            page(
                "text/html; charset=utf-8",
                include_str!("../pages/session.html"),
            ),
        )
        .route(
            "/pages/style.css",
            page(
                "text/css; charset=utf-8",
                include_str!("../pages/style.css"),
            ),
        )
        .route(
            "/pages/list.js",
            page(
                "text/javascript; charset=utf-8",
                include_str!("../pages/list.js"),
            ),
        )
        .route(
            "/pages/session.js",
            page(
                "text/javascript; charset=utf-8",
                include_str!("../pages/session.js"),
            ),
        )
        .route(
            "/pages/icon.svg",
            page("image/svg+xml", include_str!("../pages/icon.svg")),
        );
    #[cfg(feature = "web")]
    let pages = web::with_viewer(pages);
    pages.layer(middleware::map_response(guard))
}

fn page(content_type: &'static str, body: &'static str) -> MethodRouter {
    get(async move || {
        (
            [(CONTENT_TYPE, content_type), (CACHE_CONTROL, ASK_AGAIN)],
            body,
        )
            .into_response()
    })
}

async fn guard(mut response: Response) -> Response {
    let headers = response.headers_mut();
    headers.insert(CONTENT_SECURITY_POLICY, POLICY);
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    // The feed tells by it which session a page shows.
    headers.insert(REFERRER_POLICY, HeaderValue::from_static("same-origin"));
    response
}

/// The browser's viewer, which the build script compressed. Every browser that can run it takes gzip.
#[cfg(feature = "web")]
mod web {
    use axum::http::header::CONTENT_ENCODING;
    use axum::response::IntoResponse as _;

    use super::{CACHE_CONTROL, CONTENT_TYPE, MethodRouter, Router, get};

    /// Its version is in its address, so it never changes there.
    const FOR_EVER: &str = "public, max-age=31536000, immutable";

    pub(super) fn with_viewer(pages: Router) -> Router {
        pages
            .route(
                "/viewer/0.36.3/viewer.js",
                compressed(
                    "text/javascript; charset=utf-8",
                    include_bytes!(concat!(env!("OUT_DIR"), "/viewer.js.gz")),
                ),
            )
            .route(
                "/viewer/0.36.3/viewer.wasm",
                compressed(
                    "application/wasm",
                    include_bytes!(concat!(env!("OUT_DIR"), "/viewer.wasm.gz")),
                ),
            )
    }

    fn compressed(content_type: &'static str, body: &'static [u8]) -> MethodRouter {
        let headers = [
            (CONTENT_TYPE, content_type),
            (CONTENT_ENCODING, "gzip"),
            (CACHE_CONTROL, FOR_EVER),
        ];
        get(async move || (headers, body).into_response())
    }
}
