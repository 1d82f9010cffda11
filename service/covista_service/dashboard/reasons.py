"""Why the station drops, turns away or loses something, in plain words, and what can be done about it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Words(NamedTuple):
    """What it means, and what to do; up to `bearable` a minute it is nothing to worry about, None: never."""

    means: str
    todo: str
    bearable: float | None = 0.0


_FIX_ROVER = "Look at the robot's own page for its last problem, and mend its program."
_CAMERA = "Mend the camera's numbers on the robot."
DROPPED: Mapping[str, Words] = {
    "malformed": Words("It is no message of the kind that its key promises.", _FIX_ROVER),
    "wrong_id": Words(
        "The name inside is not that of the key: a robot speaks as another, or has no proper name.", _FIX_ROVER
    ),
    "bad_camera": Words("Focal length, size or distortion of the camera make no sense.", _CAMERA),
    "bad_pose": Words(
        "The pose has numbers missing or not finite, or no unit quaternion.", "Look at the robot's localisation."
    ),
    "no_content": Words("A keyframe came with neither a picture nor features.", _FIX_ROVER),
    "bad_features": Words("Features do not fit their count, or lie outside of the picture.", _FIX_ROVER),
    "unknown_descriptor": Words("Features are of a kind that the station does not know.", "Send rootsift or orb."),
    "bad_image": Words(
        "The picture cannot be decoded, is cut short, or is not of the camera's size.",
        "Look at the robot's camera and at its link.",
    ),
    "image_too_large": Words("The picture claims more than 50 megapixels.", "Send smaller pictures."),
    "too_large": Words("A pose above 16 KiB or a keyframe above 4 MiB; it was not read.", "Send smaller messages."),
    "overflow": Words(
        "More came at once than the station keeps, so it went unread.", "Have the robot send less often."
    ),
    "forgotten": Words("Its robot was forgotten while the message waited.", "Nothing: that is as it should be.", None),
}
TURNED_AWAY: Mapping[str, Words] = {
    "wrong_key": Words("A message on a key that names no robot.", "Look at the key that the sender publishes on."),
    "too_many_robots": Words(
        "The station hears 4096 robots and has no room for more.",
        "Have fewer robots send; a place is free ten minutes after its robot fell silent.",
    ),
    "unknown_robot": Words(
        "Something unreadable came under a name that has never said anything readable.",
        "Look who publishes there; the log has the names.",
    ),
}
LINK_REFUSED: Mapping[str, Words] = {
    "handshake": Words(
        "Somebody connected without a certificate of ours, or with one that has expired.",
        "The log has zenoh's words. Look at the certificates and clocks of robots that are missing.",
    ),
    "unlisted": Words(
        "A robot with a good certificate is not in the list, and can do nothing.",
        "Add it to the list of robots if it belongs to you; the log has its name and address.",
    ),
    "mute": Words(
        "A robot is connected and not alive under the name of its certificate.",
        "Look whether it speaks under another name, or somebody only listens with its certificate.",
    ),
}
_GUESSES = "If it goes on, see in the log from where it comes."
_MINUTE = 60.0
ACCESS_REFUSED: Mapping[str, Words] = {
    "missing": Words("Asked without a token.", _GUESSES, _MINUTE),
    "malformed": Words("What was shown is no token.", _GUESSES, _MINUTE),
    "unknown": Words(
        "A token that the station does not know: somebody guesses, or uses another station's.", _GUESSES, 6.0
    ),
    "revoked": Words("A token that was revoked.", "Give that client a new token, or stop it.", _MINUTE),
    "session": Words("A browser whose session has ended.", "Nothing: it is asked to log in.", _MINUTE),
    "origin": Words("A page of somebody else made a browser ask.", "Ask its user what they have open.", 6.0),
    "scope": Words(
        "A token that does not allow what was asked.", "Give a token of scope operate where it is meant.", _MINUTE
    ),
    "limited": Words("Too many wrong tokens came from one address.", _GUESSES, 0.0),
    "unread": Words("The tokens cannot be read, so nobody is let in.", "See that the database can be reached."),
    "host": Words("The station was called by a name that is none of its own.", _GUESSES, 6.0),
}
GIVEN_UP: Mapping[str, Words] = {
    "slow": Words("A client read its answer too slowly and was cut off.", "Look at that client's network."),
    "silent": Words("A connection on which nobody asked anything was closed.", "Nothing: that is housekeeping.", None),
    "behind": Words("A listener to events fell behind and was cut off.", "It can catch up from the history."),
    "crowd": Words("Too many clients at once; some were turned away.", "Close some, or find out who asks."),
    "busy": Words("Too many large answers at once; some were refused.", "Have clients ask less often for the matrix."),
}
TROUBLES: Mapping[str, Words] = {
    "missing": Words(
        "Sent by robots, and never came: lost on the way.", "Look at the network between robots and station.", 6.0
    ),
    "loop": Words("An error of the station's own, in its main loop; it went on.", "A bug: the log has its traceback."),
    "sink": Words(
        "An error of the station's own while telling the news; it went on.", "A bug: the log has its traceback."
    ),
    "station": Words("An error of the station's own while judging; it went on.", "A bug: the log has its traceback."),
    "zenoh": Words(
        "News that no robot or listener could be told.", "Look at the link; the newest groups are told again."
    ),
    "history": Words(
        "News that the history will never have.", "See that the database can be reached, is fast, and has room."
    ),
    "worker_failed": Words(
        "A comparison of two pictures failed.", "A bug, or a worker that died: the log has its traceback."
    ),
    "lost": Words("A worker died, left, or was ended.", "Look at the memory of the machines where workers run."),
    "retried": Words("A job was done again, since its worker died or was silent.", "Look at the workers."),
    "overdue": Words("A job did not come back within 30 s.", "Look at the load of the workers."),
    "given_up": Words("Two workers died of a job or never came back with it.", "The log names the pictures."),
}
UNTOLD = Words("This page has no words for that.", "The log may say more.")
