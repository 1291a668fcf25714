#!/usr/bin/env python3
"""Runs batches on an S3 server that fails and stalls, with workers that are killed, and compares with local folders.

usage: object_store.py --boresight target/debug/boresight [--sessions 60] [--kills 20] [--seed 1]

Needs a build with the features cloud and report, and moto[server] and boto3 from PyPI.
"""
import argparse, http.client, http.server, json, os, pathlib, random, shutil, signal, socket, subprocess, sys, tempfile
import threading, time

import boto3

FIXTURES = pathlib.Path(__file__).resolve().parents[2] / "fixtures/recordings/v1"
RECORDINGS = ["good", "focus-moved", "focus-moved-unseen", "installed-camera-changed"]
SECRET = "b0resightSecretOfThisTest"
# Silence of the store after which boresight asks again, and how long the store is silent.
PATIENCE_SECS, STALL_SECS = 2, 5


class Proxy(http.server.ThreadingHTTPServer):
    """Hands requests to the S3 server, but fails 5 % of them and stalls 1 %, before or after they were heard."""

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, server, seed):
        self.server, self.random, self.lock = server, random.Random(seed), threading.Lock()
        # moto looks whether an object is there and stores it in two steps; S3 does in one.
        self.one_put = threading.Lock()
        self.counts = {"requests": 0, "errors": 0, "stalls": 0}
        self.is_calm = False
        super().__init__(("127.0.0.1", 0), Handler)

    def fate(self):
        with self.lock:
            self.counts["requests"] += 1
            dice, heard = self.random.random(), self.random.random() < 0.5
            if self.is_calm or dice >= 0.06:
                return None, heard
            kind = "errors" if dice < 0.05 else "stalls"
            self.counts[kind] += 1
            return kind, heard


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def answer(self, status, headers, body):
        self.send_response(status)
        for name, value in headers:
            if name.lower() not in ("transfer-encoding", "connection", "content-length", "date", "server"):
                self.send_header(name, value)
        length = dict((n.lower(), v) for n, v in headers).get("content-length", "0")
        self.send_header("Content-Length", length if self.command == "HEAD" else str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def heard(self, body):
        with self.server.one_put if self.command == "PUT" else threading.Lock():
            server = http.client.HTTPConnection("127.0.0.1", self.server.server, timeout=60)
            server.request(self.command, self.path, body, dict(self.headers))
            answer = server.getresponse()
            return answer.status, answer.getheaders(), answer.read()

    def handle_one(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        if "/forbidden" in self.path:
            said = f"<Error><Code>AccessDenied</Code><AWSAccessKeyId>{SECRET}</AWSAccessKeyId></Error>"
            return self.answer(403, [], said.encode())
        kind, heard = self.server.fate()
        if kind is None or heard:
            answer = self.heard(body)
        if kind is None:
            return self.answer(*answer)
        if kind == "stalls":
            time.sleep(STALL_SECS)
            self.close_connection = True
            return None
        code = self.server.random.choice([500, 503])
        name = "InternalError" if code == 500 else "SlowDown"
        return self.answer(code, [], f"<Error><Code>{name}</Code></Error>".encode())

    do_GET = do_PUT = do_HEAD = do_POST = do_DELETE = handle_one

    def handle(self):
        try:
            super().handle()
        except (ConnectionError, TimeoutError):
            pass


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def poisoned(folder, kind):
    """What a batch meets in the field, the same in a folder and in the store."""
    journal, header = folder / "journal.jsonl", folder / "session.toml"
    if kind == 0:
        journal.unlink()
    elif kind == 1:
        text = journal.read_text()
        journal.unlink()
        journal.write_text(text.replace('"body"', '"bodx"', 1))
    elif kind == 2:
        text = header.read_text()
        header.unlink()
        header.write_text(text[: len(text) // 2] + "\n[")
    else:
        header.unlink()
        header.write_bytes(b"# \n" * (1 << 19))


def make_sessions(place, count):
    for number in range(count):
        to = place / f"sessions/{number % 7:02}/{number:05}"
        shutil.copytree(FIXTURES / RECORDINGS[number % 4], to, copy_function=os.link)
        if number % 20 == 19:
            poisoned(to, number // 20 % 4)


class Fleet:
    def __init__(self, program, place, endpoint):
        self.program, self.place, self.said = program, place, []
        clean = {name: value for name, value in os.environ.items() if not name.startswith(("AWS_", "HTTP"))}
        self.variables = clean | {
            "AWS_ENDPOINT_URL": endpoint, "AWS_ALLOW_HTTP": "true", "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": SECRET,
            "AWS_READ_TIMEOUT": f"{PATIENCE_SECS} seconds", "TMPDIR": str(place / "tmp"),
        }
        (place / "tmp").mkdir()

    def start(self, *arguments, **variables):
        environment = self.variables | variables
        environment = {name: value for name, value in environment.items() if value is not None}
        return subprocess.Popen(
            [self.program, "batch", *map(str, arguments)], cwd=self.place, env=environment,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )

    def run(self, *arguments, code=0, **variables):
        child = self.start(*arguments, **variables)
        out, err = child.communicate(timeout=1200)
        self.said += [out, err]
        assert child.returncode == code, (arguments, child.returncode, err)
        return out, err

    def results(self, out):
        return self.run("gather", out)[0]


def killed(fleet, manifest, out, kills, random_numbers):
    """Starts shards, two workers on one of them, and kills them again and again."""
    count = 0
    while count < kills:
        shards = ["1/3", "2/3", "2/3", "3/3"]
        children = [
            fleet.start("run", manifest, "--action", "replay", "--out", out, "--jobs", 1, "--shard", shard)
            for shard in shards
        ]
        time.sleep(random_numbers.uniform(0.2, 4.0))
        for child in children:
            if child.poll() is None:
                child.send_signal(signal.SIGKILL)
                count += 1
            child.communicate()
    return count


def versions_of(store, bucket):
    keys = {}
    for page in store.get_paginator("list_object_versions").paginate(Bucket=bucket):
        assert "DeleteMarkers" not in page, page["DeleteMarkers"]
        for version in page.get("Versions", []):
            keys[version["Key"]] = keys.get(version["Key"], 0) + 1
    return keys


def bare(results, root):
    """Rows without what names their place."""
    rows = []
    for line in results.splitlines():
        row = json.loads(line)
        del row["id"]
        text = json.dumps(row, sort_keys=True)
        rows.append(text.replace(root, "ROOT"))
    return sorted(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--boresight", required=True, type=os.path.abspath)
    parser.add_argument("--sessions", type=int, default=60)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    port = free_port()
    moto = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )
    try:
        with tempfile.TemporaryDirectory() as place:
            check(options, port, pathlib.Path(place))
    finally:
        moto.kill()


def connected(port):
    until = time.monotonic() + 60
    while True:
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            break
        except OSError:
            assert time.monotonic() < until, "moto doesn't start"
            time.sleep(0.1)
    return boto3.client(
        "s3", endpoint_url=f"http://127.0.0.1:{port}", region_name="us-east-1",
        aws_access_key_id="test", aws_secret_access_key=SECRET,
    )


def check(options, port, place):
    store = connected(port)
    store.create_bucket(Bucket="fleet")
    store.put_bucket_versioning(Bucket="fleet", VersioningConfiguration={"Status": "Enabled"})
    proxy = Proxy(port, options.seed)
    threading.Thread(target=proxy.serve_forever, daemon=True).start()
    fleet = Fleet(options.boresight, place, f"http://127.0.0.1:{proxy.server_address[1]}")

    make_sessions(place, options.sessions)
    for file in sorted((place / "sessions").rglob("*")):
        if file.is_file():
            store.put_object(Bucket="fleet", Key=str(file.relative_to(place)), Body=file.read_bytes())

    def stage(name, began):
        print(f"{name}: {time.monotonic() - began:.1f} s, {proxy.counts}", flush=True)

    began = time.monotonic()
    fleet.run("plan", "sessions")
    local = fleet.run("plan", "sessions")[0]
    remote = fleet.run("plan", "s3://fleet/sessions")[0]
    (place / "local.jsonl").write_text(local)
    (place / "remote.jsonl").write_text(remote)
    planned = [[json.loads(line) for line in text.splitlines()] for text in (local, remote)]
    assert len(planned[0]) == options.sessions
    for one, other in zip(*planned, strict=True):
        assert one["content"] == other["content"] and one["bytes"] == other["bytes"], (one, other)
        assert one["session"].removeprefix(f"{place}/") == other["session"].removeprefix("s3://fleet/")
    stage(f"plan: {options.sessions} sessions, the same contents", began)

    began = time.monotonic()
    replay = ["--action", "replay", "--out"]
    fleet.run("run", "local.jsonl", *replay, "local")
    calm = fleet.results("local")
    assert len(calm.splitlines()) == options.sessions
    stage("local run", began)

    began = time.monotonic()
    numbers = random.Random(options.seed)
    kills = killed(fleet, "remote.jsonl", "s3://fleet/killed", options.kills, numbers)
    for shard in ["1/3", "2/3", "3/3"]:
        fleet.run("run", "remote.jsonl", *replay, "s3://fleet/killed", "--shard", shard)
    results = fleet.results("s3://fleet/killed")
    assert bare(results, "s3://fleet/") == bare(calm, f"{place}/")
    codes = [json.loads(line)["code"] for line in results.splitlines()]
    assert len(codes) == options.sessions
    found = {code: codes.count(code) for code in sorted(set(codes))}
    stage(f"store to store, {kills} workers killed: complete, the same rows, {found}", began)

    began = time.monotonic()
    fleet.run("run", "remote.jsonl", *replay, "fetched")
    assert fleet.results("fetched") == results
    stage("store to folder: the same bytes", began)

    began = time.monotonic()
    killed(fleet, "local.jsonl", "s3://fleet/stored", options.kills // 2, numbers)
    fleet.run("run", "local.jsonl", *replay, "s3://fleet/stored")
    assert fleet.results("s3://fleet/stored") == calm
    _, said = fleet.run("run", "local.jsonl", *replay, "s3://fleet/stored")
    assert f"{options.sessions} had one before" in said, said
    stage("folder to store: the same bytes as a local run", began)

    began = time.monotonic()
    store.put_object(Bucket="fleet", Key="lists/few.jsonl", Body="".join(remote.splitlines(True)[:6]))
    for more in (["redetect"], ["report"], ["export", "--format", "ros-yaml"], ["calibrate"]):
        name = more[0]
        arguments = ["run", "s3://fleet/lists/few.jsonl", "--action", *more, "--out"]
        fleet.run(*arguments, f"s3://fleet/{name}")
        fleet.run(*arguments, name)
        rows = fleet.results(f"s3://fleet/{name}")
        assert rows == fleet.results(name) and len(rows.splitlines()) == 6
        files = [json.loads(row)["file"] for row in rows.splitlines()]
        for file in filter(None, files):
            stored = store.get_object(Bucket="fleet", Key=f"{name}/{file}")["Body"].read()
            assert stored == (place / name / file).read_bytes(), file
        if name in ("report", "export"):
            assert any(files)
    stage("every action, a manifest in the store, files beside rows: the same bytes", began)

    versions = versions_of(store, "fleet")
    twice = {key: count for key, count in versions.items() if count != 1}
    assert not twice, twice
    rows = sum(key.startswith("killed/items/") for key in versions)
    assert rows == options.sessions
    print(f"{len(versions)} objects, one version each")

    proxy.is_calm = True
    for bucket, said in [("nowhere", "no such bucket"), ("forbidden", "refuses it (AccessDenied)")]:
        for arguments in (["plan", f"s3://{bucket}"], ["gather", f"s3://{bucket}/out"],
                          ["run", "local.jsonl", *replay, f"s3://{bucket}/out"]):
            assert said in fleet.run(*arguments, code=1)[1], arguments
    none = {"AWS_ACCESS_KEY_ID": None, "AWS_SECRET_ACCESS_KEY": None, "AWS_EC2_METADATA_DISABLED": "true",
            "AWS_METADATA_ENDPOINT": "http://127.0.0.1:9"}
    assert "no credentials" in fleet.run("plan", "s3://fleet", code=1, **none)[1]
    assert "AWS_ALLOW_HTTP" in fleet.run("plan", "s3://fleet", code=1, AWS_ALLOW_HTTP=None)[1]
    nobody = fleet.run("plan", "s3://fleet", code=1, AWS_ENDPOINT_URL="http://127.0.0.1:9")[1]
    assert "doesn't answer" in nobody, nobody
    assert "There is no session" in fleet.run("plan", "s3://fleet/killed", code=1)[1]

    assert not any(SECRET in text for text in fleet.said)
    for key in versions:
        if not key.startswith("sessions/"):
            assert SECRET.encode() not in store.get_object(Bucket="fleet", Key=key)["Body"].read()
    counts = proxy.counts
    print(f"{counts['requests']} requests: {100 * counts['errors'] / counts['requests']:.1f} % failed, "
          f"{100 * counts['stalls'] / counts['requests']:.1f} % stalled")


if __name__ == "__main__":
    main()
