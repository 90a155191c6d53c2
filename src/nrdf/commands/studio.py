"""`nrdf studio`: the browser application."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

from nrdf.commands.console import command_line, console, errors, versions
from nrdf.commands.options import File, Folder, Metavar
from nrdf.commands.output_lock import lock_output
from nrdf.io.bounds import Bounds


@lock_output("session")
def studio(
    session: Folder = Path("studio"),
    host: str = "127.0.0.1",
    port: Annotated[int, Bounds(1, 65535)] = 8080,
    allow_host: tuple[str, ...] = (),
    no_browser: bool = False,
    device: str = "cpu",
    robot: File | None = None,
    tool_frame: Annotated[str, Metavar("NAME")] | None = None,
    cell: File | None = None,
) -> None:
    """Paint regions and describe processes in a browser.

    And see them on other objects. Prints an address and opens it. Everything done there is kept in
    the session's folder at once; the same command goes on with it. Ctrl-C ends. Needs:
    pip install 'nrdf[studio]'.

    Example: nrdf studio --session my-chairs

    Args:
        session: Folder that the session is kept in; made if missing.
        host: Address to listen on. Whoever reaches it can use the studio, so by default only this
            computer.
        port: Port to listen on; the next free one where it is taken.
        allow_host: Further names that this computer is asked by.
        no_browser: Do not open a browser.
        device: cpu, cuda, cuda:N or auto.
        robot: URDF or MJCF of the arm for simulations; the bundled arm unless given.
        tool_frame: Body or site of the robot that the tool is mounted on.
        cell: Cell file: simulations and programs are for it, in its robot's base frame.
    """
    from nrdf.errors import ConfigError, ModelError, OutputError

    try:
        import viser  # noqa: F401
    except ImportError:
        raise OutputError(
            "the studio needs viser: pip install 'nrdf[studio]' (or pip install viser)"
        ) from None
    import nrdf
    from nrdf.field.zoo import list_models
    from nrdf.serve.hosts import is_loopback
    from nrdf.studio.app import Studio
    from nrdf.studio.model.computing import ChildProcessComputing
    from nrdf.studio.model.session import Session
    from nrdf.studio.model.studio_cell import StudioCell
    from nrdf.studio.serving import open_server

    if cell is not None and not robot is tool_frame is None:
        raise ConfigError(
            "the cell file says robot and tool frame: leave --robot, --tool-frame out"
        )
    chosen = StudioCell(robot, tool_frame) if cell is None else StudioCell.of(cell)
    if robot is tool_frame is cell is None:
        chosen = StudioCell.kept(session) or chosen
    categories = [entry.category for entry in list_models() if entry.category]
    if not categories:
        raise ModelError("there is no trained model in this installation: install nrdf again")
    kept = Session(session)
    if kept.damage:
        errors.print(kept.damage, style="yellow")
    server = open_server(host, port, allow_host)
    origin = {"command": command_line(), "versions": versions()}
    computing = ChildProcessComputing(partial(nrdf.load_model, device=device))
    computing.start()
    app = Studio(kept, server, computing, categories, origin, chosen)
    if not is_loopback(host):
        errors.print(
            f"listening on {host}: everyone who can reach this computer there can see and change "
            "this session, and store files in its folder; there is no password",
            style="yellow",
        )
    shown = "127.0.0.1" if host in ("0.0.0.0", "::") else host
    address = f"http://{shown}:{server.get_port()}"
    console.print(f"{address}\nthe session is kept in {session}; Ctrl-C ends")
    if not no_browser:
        import webbrowser

        webbrowser.open(address)
    try:
        server.sleep_forever()
    finally:
        app.stop()
        server.stop()
