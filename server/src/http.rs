//! Plain HTTP beside gRPC: health, metrics, and the sessions as JSON for the page.

use axum::{
    Json, Router,
    extract::{Request, State},
    http::{StatusCode, header},
    middleware::Next,
    response::{IntoResponse, Response},
    routing::get,
};
use sinew_proto::v1;
use tokio_util::sync::CancellationToken;

use crate::services::Shared;

/// The routes; `/readyz` says no from the moment that `closing` is cancelled.
pub(crate) fn routes(shared: Shared, closing: CancellationToken) -> Router {
    let ready = move || {
        let closing = closing.clone();
        async move {
            match closing.is_cancelled() {
                false => (StatusCode::OK, "ready\n"),
                true => (StatusCode::SERVICE_UNAVAILABLE, "shutting down\n"),
            }
        }
    };
    Router::new()
        .route("/healthz", get(|| async { "alive\n" }))
        .route("/readyz", get(ready))
        .route("/metrics", get(metrics))
        .route("/api/sessions", get(sessions))
        .with_state(shared)
}

async fn metrics(State(shared): State<Shared>) -> impl IntoResponse {
    let kind = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    ([(header::CONTENT_TYPE, kind)], shared.metrics.text())
}

/// Lets calls of gRPC and grpc-web pass; whatever else comes here is a path that is none.
pub(crate) async fn only_calls(request: Request, next: Next) -> Response {
    let kind = request.headers().get(header::CONTENT_TYPE);
    match kind.is_some_and(|kind| kind.as_bytes().starts_with(b"application/grpc")) {
        true => next.run(request).await,
        false => (StatusCode::NOT_FOUND, "nothing is here\n").into_response(),
    }
}

/// The JSON mapping of ListSessionsResponse.
async fn sessions(State(shared): State<Shared>) -> Response {
    let all = v1::ListSessionsRequest {
        page_size: 1000,
        page_token: String::new(),
    };
    match shared.list(&all).await {
        Ok(response) => ([(header::CACHE_CONTROL, "no-store")], Json(response)).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}
