//! Everything beside plain gRPC on the same port.

use http_body_util::Full;
use hyper::{Request, StatusCode, header};
use prost::Message as _;
use sinew_proto::v1::{GetSessionRequest, ListSessionsResponse, Session};
use sinew_tests::{TestServer, live, scenes, wire, wire::Http1};
use tonic_health::pb::{
    HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
};

#[test]
fn a_healthy_server_says_so() {
    live(async {
        let server = TestServer::start().await;
        let mut http = Http1::connect(server.address()).await;
        for (path, text) in [("/healthz", "alive\n"), ("/readyz", "ready\n")] {
            let page = http.get(path).await;
            assert_eq!((page.status, page.text()), (StatusCode::OK, text));
        }
        let mut health = HealthClient::new(server.channel());
        let answer = health
            .check(HealthCheckRequest::default())
            .await
            .unwrap()
            .into_inner();
        assert_eq!(answer.status(), ServingStatus::Serving);
    });
}

/// Whether a line is one of OpenMetrics' text format.
fn is_openmetrics(line: &str) -> bool {
    let name = |name: &str| {
        let valid = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_';
        !name.is_empty() && name.bytes().all(valid)
    };
    if let Some(comment) = line.strip_prefix("# ") {
        let mut words = comment.splitn(3, ' ');
        return match (words.next(), words.next(), words.next()) {
            (Some("EOF"), None, None) => true,
            (Some("TYPE"), Some(of), Some(kind)) => {
                name(of) && matches!(kind, "counter" | "gauge" | "histogram")
            }
            (Some("HELP" | "UNIT"), Some(of), Some(text)) => name(of) && !text.is_empty(),
            _ => false,
        };
    }
    let Some((series, value)) = line.rsplit_once(' ') else {
        return false;
    };
    let (of, labels) = match series.split_once('{') {
        Some((of, labels)) => (of, labels.strip_suffix('}')),
        None => (series, Some("")),
    };
    name(of) && labels.is_some() && value.parse::<f64>().is_ok()
}

#[test]
fn metrics_are_openmetrics_and_name_no_session() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("very-particular", scenes::small()).await;
        let mut watcher = session.watch().await;
        watcher.keyframe().await;
        session
            .source()
            .await
            .send_and_close(&scenes::rest(8))
            .await;
        session.step(1).await.unwrap();
        watcher.frame().await;
        let page = Http1::connect(server.address()).await.get("/metrics").await;
        let kind = page.headers[header::CONTENT_TYPE].to_str().unwrap();
        assert!(kind.starts_with("application/openmetrics-text"), "{kind}");
        let text = page.text();
        for line in text.lines() {
            assert!(is_openmetrics(line), "{line:?}");
        }
        assert!(text.ends_with("# EOF\n"));
        assert!(!text.contains("very-particular"), "{text}");
        for sample in [
            "sinew_sessions 1\n",
            "sinew_subscribers 1\n",
            "sinew_steps_total 1\n",
            "sinew_step_seconds_count 1\n",
            "sinew_motion_latency_seconds_count 1\n",
            "sinew_motion_frames_total 1\n",
            "sinew_frames_sent_total 2\n",
            "sinew_frames_missed_total 0\n",
            "sinew_session_faults_total 0\n",
        ] {
            assert!(text.contains(sample), "{sample:?} is not in\n{text}");
        }
    });
}

#[test]
fn the_sessions_are_also_json() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let page = Http1::connect(server.address())
            .await
            .get("/api/sessions")
            .await;
        assert_eq!(page.headers[header::CONTENT_TYPE], "application/json");
        let listed: ListSessionsResponse = serde_json::from_slice(&page.body).unwrap();
        let mut told = session.get().await.unwrap();
        told.mapping = None; // lists leave it out
        assert_eq!(listed.sessions, [told]);
        // Named as protobuf's JSON mapping has it.
        assert!(
            page.text().contains(r#""vertexCount":27"#),
            "{}",
            page.text()
        );
    });
}

#[test]
fn the_page_lets_nothing_in_from_elsewhere() {
    live(async {
        let server = TestServer::start().await;
        let mut http = Http1::connect(server.address()).await;
        for path in ["/", "/sessions/tissue"] {
            let page = http.get(path).await;
            assert_eq!(page.status, StatusCode::OK);
            assert!(
                page.headers[header::CONTENT_TYPE]
                    .to_str()
                    .unwrap()
                    .starts_with("text/html")
            );
            let policy = page.headers[header::CONTENT_SECURITY_POLICY]
                .to_str()
                .unwrap();
            assert!(policy.contains("default-src 'none'"), "{policy}");
            assert!(
                !policy.contains("unsafe-inline") && !policy.contains("http"),
                "{policy}"
            );
        }
    });
}

#[test]
fn a_path_that_is_none_is_not_found() {
    live(async {
        let server = TestServer::start().await;
        let page = Http1::connect(server.address())
            .await
            .get("/nothing/here")
            .await;
        assert_eq!(page.status, StatusCode::NOT_FOUND);
    });
}

#[test]
fn grpc_web_works_over_http_1_1() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("tissue", scenes::small()).await;
        let mut http = Http1::connect(server.address()).await;
        let mut ask = async |name: &str| {
            let message = GetSessionRequest {
                name: name.to_owned(),
            };
            let request = Request::post("/sinew.v1.SessionService/GetSession")
                .header("host", "localhost")
                .header("content-type", "application/grpc-web+proto")
                .header("x-grpc-web", "1")
                .body(Full::new(wire::framed(&message.encode_to_vec())));
            http.send(request.unwrap()).await.unwrap()
        };
        let page = ask(&session.name).await;
        assert_eq!(page.status, StatusCode::OK);
        let kind = page.headers[header::CONTENT_TYPE].to_str().unwrap();
        assert!(kind.starts_with("application/grpc-web"), "{kind}");
        let length = u32::from_be_bytes(page.body[1..5].try_into().unwrap()) as usize;
        let (message, trailers) = page.body[5..].split_at(length);
        assert_eq!(
            Session::decode(message).unwrap(),
            session.get().await.unwrap()
        );
        assert_eq!(trailers[0], 0x80);
        let trailers = str::from_utf8(&trailers[5..]).unwrap();
        assert!(
            trailers.replace(' ', "").contains("grpc-status:0"),
            "{trailers}"
        );

        let refused = ask("sessions/nobody").await;
        let told = refused
            .headers
            .get("grpc-status")
            .map(|value| value.to_str().unwrap());
        let body = String::from_utf8_lossy(&refused.body).replace(' ', "");
        assert!(
            told == Some("5") || body.contains("grpc-status:5"),
            "{refused:?}"
        );
    });
}

/// Asks a reflection service for the names of all services.
macro_rules! services_by {
    ($version:ident, $channel:expr) => {{
        use tonic_reflection::pb::$version::{
            ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
            server_reflection_request::MessageRequest, server_reflection_response::MessageResponse,
        };
        let request = ServerReflectionRequest {
            host: String::new(),
            message_request: Some(MessageRequest::ListServices(String::new())),
        };
        let mut client = ServerReflectionClient::new($channel);
        let answer = client
            .server_reflection_info(tokio_stream::iter([request]))
            .await;
        let answer = answer
            .unwrap()
            .into_inner()
            .message()
            .await
            .unwrap()
            .unwrap();
        let Some(MessageResponse::ListServicesResponse(list)) = answer.message_response else {
            panic!("{answer:?} lists no services");
        };
        list.service
            .into_iter()
            .map(|service| service.name)
            .collect::<Vec<_>>()
    }};
}

#[test]
fn reflection_lists_every_service_in_both_versions() {
    live(async {
        let server = TestServer::start().await;
        for services in [
            services_by!(v1, server.channel()),
            services_by!(v1alpha, server.channel()),
        ] {
            for service in [
                "SessionService",
                "MotionService",
                "MeshService",
                "AssetService",
            ] {
                let name = format!("sinew.v1.{service}");
                assert!(services.contains(&name), "{name} is not in {services:?}");
            }
            assert!(
                services.iter().any(|name| name == "grpc.health.v1.Health"),
                "{services:?}"
            );
        }
    });
}
