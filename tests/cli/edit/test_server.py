"""The server of the live cell as an attacker meets it: raw bytes in, and nothing out that is not meant."""

import json
import socket
import time
from collections.abc import Iterator

import pytest
from builders.edit_server import FAST, TOKEN, Served, everything, parsed, served

from cellplan.cli.edit.server import Limits, loopback_listener
from cellplan.errors import InputError

STATED = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Connection": "close",
}
CHANGE = {"number": 3, "block": None, "values": {"x": 5.0}}


@pytest.fixture(scope="module")
def page() -> Iterator[Served]:
    with served() as running:
        yield running


def refused(answer: tuple[int, dict[str, str], bytes], status: int) -> str:
    """The line with which a request was refused, with the headers of every response and nothing else."""
    assert answer[0] == status
    body = json.loads(answer[2])
    assert answer[1] == {**STATED, "Content-Type": "application/json", "Content-Length": str(len(answer[2]))}
    assert list(body) == ["error"]
    assert "\n" not in body["error"]
    assert TOKEN not in body["error"]
    return str(body["error"])


def test_the_page_has_the_stated_headers_and_needs_no_token(page: Served) -> None:
    status, headers, body = page.get("/")

    assert (status, body) == (200, b"<p>page</p>")
    assert headers == {**STATED, "Content-Type": "text/html; charset=utf-8", "Content-Length": "11"}


def test_data_comes_to_the_page_with_its_token_only(page: Served) -> None:
    status, headers, body = page.post("/open")

    assert (status, json.loads(body)["schema"]) == (200, "cellplan.edit/1")
    assert headers == {**STATED, "Content-Type": "application/json", "Content-Length": str(len(body))}


@pytest.mark.parametrize("token", ["", None, "t" * 42, "u" * 43, "t" * 44, "T" * 43, "\xff" * 43])
def test_a_wrong_or_dead_token_is_refused(page: Served, token: str | None) -> None:
    for path in ("/open", "/change", "/do", "/events"):
        assert "token" in refused(page.post(path, X_Cellplan_Token=token), 403)


@pytest.mark.parametrize("path", ["/open?token=" + TOKEN, "/?token=" + TOKEN, "/#token=" + TOKEN])
def test_a_token_in_the_address_is_refused(page: Served, path: str) -> None:
    refused(page.post(path, X_Cellplan_Token=None), 404)
    refused(page.get(path), 404)


@pytest.mark.parametrize(
    "origin",
    [None, "null", "", "http://evil.example", "https://127.0.0.1:{port}", "http://localhost:{port}", "file://"],
)
def test_another_origin_is_refused(page: Served, origin: str | None) -> None:
    given = None if origin is None else origin.format(port=page.port)

    assert "origin" in refused(page.post("/open", Origin=given), 403)
    if given:
        assert "origin" in refused(page.get("/", Origin=given), 403)


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:{port}",
        "127.0.0.1",
        "127.0.0.1:1",
        "127.0.0.1:{port}.evil.example",
        "",
        "[::1]:{port}",
    ],
)
def test_a_rebound_name_is_refused_for_pages_and_data(page: Served, host: str) -> None:
    name = host.format(port=page.port)

    assert "host" in refused(page.get("/", Host=name), 403)
    assert "host" in refused(page.post("/open", Host=name, Origin=f"http://{name}"), 403)


def test_the_name_localhost_is_that_of_the_server_too(page: Served) -> None:
    name = f"localhost:{page.port}"

    assert page.post("/open", Host=name, Origin=f"http://{name}")[0] == 200


@pytest.mark.parametrize(
    "kind",
    ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=b", None, "application/jsonp"],
)
def test_what_a_form_or_a_simple_request_could_send_is_refused(page: Served, kind: str | None) -> None:
    assert "application/json" in refused(page.post("/change", CHANGE, Content_Type=kind), 415)


@pytest.mark.parametrize(
    "path",
    [
        "/..%2f..%2fetc%2fpasswd",
        "/../cell.yaml",
        "/cell.yaml",
        "//",
        "/edit.js/",
        "/edit.js?x",
        "/EDIT.JS",
        "/%2e%2e/",
        "*",
        "/open/",
    ],
)
def test_no_path_leads_to_a_file(page: Served, path: str) -> None:
    refused(page.get(path), 404)
    refused(page.post(path), 404)


@pytest.mark.parametrize("method", ["OPTIONS", "PUT", "DELETE", "HEAD", "TRACE", "CONNECT", "PATCH"])
def test_other_methods_are_refused_without_permissions_for_other_origins(page: Served, method: str) -> None:
    for path in ("/", "/change"):
        refused(page.send(f"{method} {path} HTTP/1.1", {"Host": f"127.0.0.1:{page.port}"}), 501)


def test_a_preflight_is_refused(page: Served) -> None:
    head = {"Origin": "http://evil.example", "Access-Control-Request-Method": "POST", "Host": f"127.0.0.1:{page.port}"}

    refused(page.send("OPTIONS /change HTTP/1.1", head), 403)


def test_each_path_has_one_method(page: Served) -> None:
    refused(page.get("/open"), 405)
    refused(page.post("/"), 405)


def test_a_body_of_64_kb_is_read_and_one_byte_more_is_not(page: Served) -> None:
    body = json.dumps({}).encode()

    assert page.post("/open", body.ljust(65_536))[0] == 200
    assert "65536 bytes, got 65537" in refused(page.post("/open", body.ljust(65_537)), 413)
    assert "got 10000000" in refused(page.post("/open", b" " * 10_000_000), 413)


def test_ten_megabytes_in_chunks_are_refused_before_they_are_read(page: Served) -> None:
    chunk = b"10000\r\n" + b" " * 65_536 + b"\r\n"
    head = "".join(f"{name}: {value}\r\n" for name, value in page.head("/open").items())

    answer = page.exchange(f"POST /open HTTP/1.1\r\n{head}Transfer-Encoding: chunked\r\n\r\n".encode() + 160 * chunk)

    assert "not in chunks" in refused(answer, 411)
    refused(page.post("/open", Transfer_Encoding="chunked"), 411)


@pytest.mark.parametrize("length", ["-1", "+2", "2, 2", "0x2", "", "1e1", "9" * 13])
def test_a_length_that_is_no_plain_number_is_refused(page: Served, length: str) -> None:
    refused(page.send("POST /open HTTP/1.1", {**page.head("/open"), "Content-Length": length}, b"{}"), 411)


@pytest.mark.parametrize(
    "head",
    [
        b"GET /\r\n\r\n",
        b"GET / HTTP/1.0\r\nHost: 127.0.0.1:{port}\r\n\r\n",
        b"GET  / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nHost: 127.0.0.1:{port}\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost : 127.0.0.1:{port}\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n folded: x\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\nOrigin: null\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX: \x00\r\n\r\n",
        b"\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n",
    ],
)
def test_a_head_of_another_form_is_refused(page: Served, head: bytes) -> None:
    refused(page.exchange(head.replace(b"{port}", str(page.port).encode())), 400)


def test_headers_that_do_not_end_are_refused(page: Served) -> None:
    head = f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{page.port}\r\nX: ".encode()

    refused(page.exchange(head + 200_000 * b"x"), 431)


def test_a_head_that_comes_slowly_ends_after_its_time_and_not_after_that_of_its_last_byte(page: Served) -> None:
    begin = time.monotonic()
    with page.connect() as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nX: ")
        connection.settimeout(0.05)
        answer = b""
        while not answer:
            connection.sendall(b"x")
            try:
                answer = connection.recv(65_536)
            except TimeoutError:
                assert time.monotonic() - begin < 20 * FAST.receive_s

    assert "within 0.3 s" in refused(parsed(answer), 408)
    assert Limits().receive_s == 5.0


def test_a_body_that_does_not_come_ends_after_its_time(page: Served) -> None:
    refused(page.send("POST /open HTTP/1.1", {**page.head("/open"), "Content-Length": "100"}, b"{"), 408)


def test_a_ninth_connection_is_refused_and_a_closed_one_makes_place(page: Served) -> None:
    with served(Limits(linger_s=0.2)) as running:
        idle = [running.connect() for _ in range(8)]
        time.sleep(0.05)  # until they are accepted
        with running.connect() as ninth:
            answer = parsed(everything(ninth))
        for connection in idle:
            connection.close()
        deadline = time.monotonic() + 10.0
        while (status := running.get("/")[0]) != 200:
            assert time.monotonic() < deadline

    assert "at most 8 connections" in refused(answer, 503)
    assert status == 200


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ({"values": {"x": "5"}}, "expected a finite number, got '5'"),
        ({"values": {"x": True}}, "expected a finite number, got true"),
        ({"values": {"x": None}}, "expected a finite number, got nothing"),
        ({"values": {"x": [1]}}, "expected a finite number, got a list of 1"),
        (b'{"values": {"x": NaN}}', "expected finite numbers, got NaN"),
        (b'{"values": {"x": -Infinity}}', "expected finite numbers, got -Infinity"),
        (b'{"values": {"x": 1e999}}', "expected a finite number, got inf"),
        (b'{"values": {"x": 1' + 400 * b"0" + b"}}", "expected a finite number, got 1000"),
        (b'{"values": {"x": 1' + 9000 * b"0" + b"}}", "request: "),
        ({"values": {"z": 5.0}}, "z: is no address of this cell"),
        ({"values": {"../../etc/passwd": 5.0}}, "../../etc/passwd: is no address of this cell"),
        ({"values": {"\ud800\n": 5.0}}, "is no address of this cell"),
        ({"values": {}}, "expected an object of numbers by address"),
        ({"values": 5}, "expected an object of numbers by address, got 5"),
        ({"values": {"x": 5.0}, "file": "cell.yaml"}, "'file': unknown key"),
        ({"values": {"x": 5.0}, "number": -1}, "number: expected a whole number"),
        ({"values": {"x": 5.0}, "block": 1.5}, "block: expected a whole number"),
        (b'{"values": {"x": 1}, "values": {"x": 2}}', "stands twice"),
        (b"[1]", "expected a JSON object"),
        (b"", "expected JSON"),
        (b"\xff", "request"),
        (60_000 * b"[", "deeply nested"),
    ],
)
def test_a_change_is_a_finite_number_at_a_listed_address(page: Served, body: object, why: str) -> None:
    before = dict(page.session.values)

    assert why in refused(page.post("/change", body), 400)
    assert page.session.values == before


@pytest.mark.parametrize("body", [{}, {"action": "rm"}, {"action": 5}, {"action": "save", "argument": "other.yaml"}])
def test_an_action_is_one_of_a_list_with_a_number_at_most(page: Served, body: object) -> None:
    refused(page.post("/do", body), 400)


def test_a_fault_of_the_program_is_one_line_and_the_session_goes_on(page: Served) -> None:
    assert "a fault of the program" in refused(page.post("/do", {"action": "repair"}), 500)
    assert page.post("/open")[0] == 200


def test_only_the_loopback_address_is_served_and_a_used_port_is_named(page: Served) -> None:
    with loopback_listener(0) as listener:
        assert (listener.family, listener.getsockname()[0]) == (socket.AF_INET, "127.0.0.1")
    with pytest.raises(InputError, match=f"^--port: {page.port} cannot be used: address already in use; choose"):
        loopback_listener(page.port)
