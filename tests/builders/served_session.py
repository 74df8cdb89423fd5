"""A true session of the live cell behind its server, and its page in a browser."""

import secrets
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from builders.browser import READY, Browser
from cellplan.cli.edit.owner import Owner
from cellplan.cli.edit.page.texts import page_texts
from cellplan.cli.edit.server import Server, loopback_listener
from cellplan.session.executor import ProcessExecutor
from cellplan.session.session import Session

REST = """
  const until = performance.now() + 120000;
  while (!(CONDITION) && performance.now() < until) await drawn();
  await drawn();
"""


@contextmanager
def live(path: Path) -> Iterator[str]:
    """The address of the page of a session, which is called in a thread of its own alone."""
    token = secrets.token_urlsafe(32)
    assets = {place: (f"{kind}; charset=utf-8", text.encode()) for place, (kind, text) in page_texts().items()}
    with loopback_listener(0) as listener:
        server = Server(listener, token, assets)
        owners, is_open = list[Owner](), threading.Event()

        def work() -> None:
            with closing(Session.open(path, executor=ProcessExecutor())) as session:
                owners.append(Owner(session, server.publish))
                is_open.set()
                owners[0].run()

        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        assert is_open.wait(60.0)
        with server.serving(owners[0].submit):
            yield f"http://127.0.0.1:{listener.getsockname()[1]}/#token={token}"
            owners[0].end("the test is over")
        thread.join(timeout=30.0)


def shown(browser: Browser, address: str) -> None:
    """Open the page and wait until the session is at rest."""
    browser.visit(address)
    browser.run(f"await {READY} look(); }}); await drawn();")
    rest(browser, "app.answer.is_settled")


def rest(browser: Browser, condition: str) -> None:
    """Wait until something holds in the page."""
    browser.run(REST.replace("CONDITION", condition))
    assert browser.run(f"return Boolean({condition});"), condition
