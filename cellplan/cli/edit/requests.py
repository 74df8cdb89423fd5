"""One HTTP request of a page: read strictly, and refused unless it comes from the page of this very session."""

import re
import secrets
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Final

HEAD_LIMIT: Final = 65_536  # [bytes] of request line and headers; browsers send cookies of other ports too
BODY_LIMIT: Final = 65_536  # [bytes]
TOKEN_HEADER: Final = "x-cellplan-token"  # noqa: S105 - a name
JSON: Final = re.compile(r"application/json(; ?charset=utf-8)?", re.IGNORECASE)
REQUEST_LINE: Final = re.compile(r"([A-Z]{1,16}) ([!-~]{1,2000}) HTTP/1\.1")
HEADER: Final = re.compile(r"([!#$%&'*+.^_`|~0-9A-Za-z-]+):[ \t]*([\t -~\x80-\xff]*?)[ \t]*")
LENGTH: Final = re.compile(r"[0-9]{1,12}")


class RefusedRequestError(Exception):
    """A request that is answered by a status and one line, whatever else it holds."""

    def __init__(self, status: HTTPStatus, text: str) -> None:
        """Say why."""
        super().__init__(text)
        self.status, self.text = status, text


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Request line and headers.

    Attributes:
        method: Such as GET.
        target: The path, with whatever the client appended to it.
        headers: Values by name in lower case.
    """

    method: str
    target: str
    headers: Mapping[str, str]


def parse_head(head: bytes) -> Request:
    """The request line and headers up to the empty line; the strict form of RFC 9112, and each header once.

    Raises:
        RefusedRequestError: It is of another form.
    """
    first, *lines = head.decode("latin-1").removesuffix("\r\n\r\n").split("\r\n")
    line, headers = REQUEST_LINE.fullmatch(first), dict[str, str]()
    if line is None:
        raise RefusedRequestError(HTTPStatus.BAD_REQUEST, "expected a request line of HTTP/1.1")
    for text in lines:
        header = HEADER.fullmatch(text)
        if header is None or header[1].lower() in headers:
            raise RefusedRequestError(HTTPStatus.BAD_REQUEST, "expected headers as NAME: VALUE, each name once")
        headers[header[1].lower()] = header[2]
    return Request(method=line[1], target=line[2], headers=headers)


def require_permitted(
    request: Request, *, port: int, token: str, gets: Collection[str], posts: Collection[str]
) -> None:
    """Refuse a request that does not come from the page of this session.

    The name under which the server was reached must be its own, or the name of another host could be pointed at it;
    the page that sends data must be the one that came from that name; and it must know the token.

    Args:
        request: Its head; of the body nothing has been read.
        port: Port of the server.
        token: Of the session.
        gets: Paths of what may be read without a token, as it holds no data.
        posts: Paths of data and changes.

    Raises:
        RefusedRequestError: It does not.
    """
    host, origin = request.headers.get("host", ""), request.headers.get("origin")
    if host not in (f"127.0.0.1:{port}", f"localhost:{port}"):
        raise RefusedRequestError(HTTPStatus.FORBIDDEN, f"expected the host 127.0.0.1:{port} or localhost:{port}")
    if origin not in (None, f"http://{host}"):
        raise RefusedRequestError(HTTPStatus.FORBIDDEN, "expected the origin of the page itself")
    if request.method not in ("GET", "POST"):
        raise RefusedRequestError(HTTPStatus.NOT_IMPLEMENTED, "expected GET or POST")
    if request.target not in {*gets, *posts}:
        raise RefusedRequestError(HTTPStatus.NOT_FOUND, "nothing is served there")
    if request.target not in (gets if request.method == "GET" else posts):
        raise RefusedRequestError(HTTPStatus.METHOD_NOT_ALLOWED, "expected the other method for this path")
    if request.method == "POST":
        _require_post(request, token)


def _require_post(request: Request, token: str) -> None:
    """What data and changes need besides."""
    if "origin" not in request.headers:
        raise RefusedRequestError(HTTPStatus.FORBIDDEN, "expected the origin of the page itself")
    if not JSON.fullmatch(request.headers.get("content-type", "")):
        raise RefusedRequestError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "expected application/json")
    sent = request.headers.get(TOKEN_HEADER, "")
    if not secrets.compare_digest(sent.encode("latin-1"), token.encode()):
        text = "expected the token of this session: open the page by the file that the terminal names"
        raise RefusedRequestError(HTTPStatus.FORBIDDEN, text)


def body_length(request: Request) -> int:
    """Number of bytes of the body; 0 without one.

    Raises:
        RefusedRequestError: It is not stated, or too large.
    """
    stated = request.headers.get("content-length", "0" if request.method == "GET" else "")
    if "transfer-encoding" in request.headers or not LENGTH.fullmatch(stated):
        raise RefusedRequestError(HTTPStatus.LENGTH_REQUIRED, "expected a body with a content-length, not in chunks")
    if int(stated) > BODY_LIMIT:
        text = f"expected a body of at most {BODY_LIMIT} bytes, got {int(stated)}"
        raise RefusedRequestError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, text)
    return int(stated)
