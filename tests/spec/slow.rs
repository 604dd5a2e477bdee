//! Readers that do not read.

use sinew_tests::{TestServer, live, scenes, scenes::Rule, wire::Http1};

/// Steps taken while the slow reader sleeps: many more than what could lie in any buffer between.
const STEPS: u64 = 400;

#[test]
fn a_reader_that_stalls_slows_nobody_and_goes_on_with_the_newest_frame() {
    live(async {
        let server = TestServer::start().await;
        // A mesh whose frames of 222 kB fill any window at once.
        let mut scene = scenes::sheet(3);
        scene.mesh = scenes::block(8, 20, Rule::Mean).mesh;
        let session = server.create("large", scene).await;
        let narrow = server.narrow_channel().await;
        let mut slow = session
            .subscribe_over(narrow, session.subscription())
            .await
            .unwrap();
        slow.keyframe().await;

        let mut fast = session.watch().await;
        session.run().await.unwrap();
        let mut frames = 0;
        while frames < 20 || fast.last().step < STEPS {
            fast.positions().await.unwrap().unwrap();
            frames += 1;
        }

        let mut read = vec![slow.last().step];
        let newest = session.pause().await.unwrap().step;
        assert!(newest >= STEPS);
        while slow.last().step < newest {
            let before = slow.last().clone();
            let frame = slow.positions().await.unwrap().unwrap();
            assert!(frame.sequence > before.sequence);
            read.push(frame.step);
        }
        // What lay in buffers, at most the outlet's eight frames more, and then the newest: not the history.
        assert!(read.len() <= 24, "{} frames: {read:?}", read.len());
        let largest_gap = read.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert!(largest_gap > Some(STEPS / 2), "{read:?}");

        let metrics = Http1::connect(server.address()).await.get("/metrics").await;
        let missed = metrics
            .text()
            .lines()
            .find_map(|line| line.strip_prefix("sinew_frames_missed_total "));
        assert!(missed.unwrap().parse::<u64>().unwrap() > STEPS / 2);
    });
}

#[test]
fn readers_that_leave_are_forgotten() {
    live(async {
        let server = TestServer::start().await;
        let session = server.create("sheet", scenes::sheet(3)).await;
        let mut http = Http1::connect(server.address()).await;
        let mut watchers = vec![session.watch().await, session.watch().await];
        for watcher in &mut watchers {
            watcher.keyframe().await;
        }
        assert!(
            http.get("/metrics")
                .await
                .text()
                .contains("sinew_subscribers 2\n")
        );
        drop(watchers);
        while !http
            .get("/metrics")
            .await
            .text()
            .contains("sinew_subscribers 0\n")
        {}
    });
}
