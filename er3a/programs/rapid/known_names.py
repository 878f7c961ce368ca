"""The instructions and functions of RAPID's controllers, by what is known of each: exact names, in capitals."""

from __future__ import annotations

from collections.abc import Container, Mapping

from er3a.programs import syntax
from er3a.programs.code_builder import variable_of

LATE = "%LATE"
"""A call by a text that names no procedure of the program."""
CHANGING = {
    "TPREADNUM": 0,
    "TPREADFK": 0,
    "TPREADDNUM": 0,
    "GETSYSDATA": 0,
    "GETDATAVAL": 1,
    "BITCLEAR": 0,
    "BITSET": 0,
    "WAITTESTANDSET": 0,
    "IVARVALUE": 2,
    "SETUPCYCLICBOOL": 0,
}
"""Instructions that change one of their arguments, by its number."""
CHANGING_OPTIONS = frozenset(("TIMEFLAG", "VALUE", "VALUEATTIMEOUT", "BREAKFLAG", "ERRORNUMBER", "RESULT"))
"""Optional arguments that instructions and functions change."""
READING = (
    *("READ", "GET", "UNPACK", "RMQGET", "RMQREAD", "RMQSENDWAIT", "SOCKETRECEIVE", "SOCKETACCEPT", "UIMSGBOX"),
    *("PACK", "COPYRAW"),
)
"""How instructions begin that may change any variable that they are given."""
CHANGING_FUNCTIONS = {"STRTOVAL": 1, "TESTANDSET": 0, "GETNEXTSYM": 0, "GETNEXTMECHUNIT": 1, "READDIR": 1}
"""Functions that change one of their arguments, by its number."""
WAITS = frozenset(
    (
        *("WAITDI", "WAITDO", "WAITAI", "WAITAO", "WAITGI", "WAITGO", "WAITUNTIL", "WAITSYNCTASK", "WAITTESTANDSET"),
        *("WAITROB", "WAITLOAD", "WAITSENSOR", "WAITWOBJ"),
    )
)
NOT_SIMULATED_TEXT = """
ACTUNIT CIRPATHMODE CORRCON CORRWRITE DEACTUNIT DROPWOBJ EOFFSON EOFFSSET INDAMOVE INDCMOVE INDDMOVE INDRESET
INDRMOVE MOTIONPROCESSMODESET MOVEEXTJ PATHRESOL SINGAREA SOFTACT SOFTDEACT SPEEDREFRESH SUPSYNCSENSOROFF
SUPSYNCSENSORON SYNCMOVEOFF SYNCMOVEON SYNCMOVERESUME SYNCMOVESUSPEND SYNCMOVEUNDO SYNCTOSENSOR TRIGGSPEED
WAITSYNCTASK WAITWOBJ WZBOXDEF WZCYLDEF WZDISABLE WZDOSET WZENABLE WZFREE WZHOMEJOINTDEF WZLIMJOINTDEF WZLIMSUP
WZSPHDEF
"""
NOT_SIMULATED = frozenset(NOT_SIMULATED_TEXT.split())
"""What is known to shape a motion or to move something else, and is not followed: it is named."""
FOLLOWED: Mapping[str, tuple[set[str], ...]] = {
    "SINGAREA": ({"OFF"},),
    "CIRPATHMODE": (set(), {"PATHFRAME"}, {"OBJECTFRAME"}),
}
"""Options with which some of these are followed. CirPathMode: an arc turns the tool with the path, as where nothing is
said, or about one axis."""
INTERRUPTING = frozenset(("IWATCH", "ITIMER", "IPERS", "IERROR", "IRMQMESSAGE", "TRIGGINT"))
"""Instructions that, like ISignalDI, order an interrupt, whose number comes last: it runs the trap of its CONNECT."""
TRIGGERS = frozenset(("TRIGGIO", "TRIGGEQUIP", "TRIGGINT", "TRIGGSPEED", "TRIGGCHECKIO", "TRIGGRAMPAO"))
"""Instructions that say what happens on the way of a TriggL and its like."""
SETTINGS = {
    **{name: f"%{name}" for name in ("CONFJ", "CONFL", "PATHACCLIM", "WORLDACCLIM")},
    **{"ACCSET": "%ACC", "VELSET": "%SPEED", "CIRPATHMODE": "%ARCS"},
    **dict.fromkeys(("PDISPSET", "PDISPON", "PDISPOFF"), "%PDISP"),
}
"""Instructions that later motions depend on, and that are followed, with the name under which each is kept."""
OUTPUTS = frozenset(
    (
        *(
            "SETDO",
            "SETAO",
            "SETGO",
            "SET",
            "RESET",
            "PULSEDO",
            "INVERTDO",
        ),
        *("MOTIONSUP", "TRIGGIO", "TRIGGEQUIP", "TRIGGINT", "TRIGGSPEED", "TRIGGCHECKIO", "TRIGGRAMPAO"),
    )
)
HARMLESS_TEXT = """
ACTEVENTBUFFER ALIASIO BITCLEAR BITSET BOOKERRNO CANCELLOAD CLEARIOBUFF CLEARRAWBYTES CLKRESET CLKSTART CLKSTOP CLOSE
CORNERPATHWARNING EGMGETID EGMRESET
CLOSEDIR COPYFILE COPYRAWBYTES DEACTEVENTBUFFER ERRLOG ERRRAISE ERRWRITE EXITCYCLE FRICIDINIT GETDATAVAL GETSYSDATA
GETTRAPDATA IDELETE IDISABLE IENABLE IERROR INVERTDO IODISABLE IOENABLE IPERS IRMQMESSAGE ISIGNALAI
ISIGNALAO ISIGNALDI ISIGNALDO ISIGNALGI ISIGNALGO ISLEEP ITIMER IVARVALUE IWATCH LOAD MAKEDIR MECHUNITLOAD MOTIONSUP
OPEN OPENDIR PACKDNHEADER PACKRAWBYTES PDISPOFF PROCERRRECOVERY PULSEDO READANYBIN READBLOCK READCFGDATA READERRDATA
READRAWBYTES REMOVEDIR REMOVEFILE RENAMEFILE RESET RESETPPMOVED RESETRETRYCOUNT RESTOPATH REWIND RMQEMPTYQUEUE
RMQFINDSLOT RMQGETMESSAGE RMQGETMSGDATA RMQGETMSGHEADER RMQREADWAIT RMQSENDMESSAGE RMQSENDWAIT SAVE SAVECFGDATA
SENDMESSAGE SET SETAO SETDATASEARCH SETDO SETGO SKIPWARN SOCKETACCEPT SOCKETBIND SOCKETCLOSE SOCKETCONNECT
SOCKETCREATE SOCKETLISTEN SOCKETRECEIVE SOCKETRECEIVEFROM SOCKETSEND SOCKETSENDTO SPYSTART SPYSTOP STARTLOAD STOREPATH
TEXTTABINSTALL TPERASE TPREADDNUM TPREADFK TPREADNUM TPSHOW TPWRITE TRIGGCHECKIO TRIGGEQUIP TRIGGINT TRIGGIO
TRIGGRAMPAO TRIGGSPEED TRYINT UIMSGBOX UIMSGWRITE UIMSGWRITEABORT UISHOW UNLOAD UNPACKRAWBYTES WARMSTART
WRITE WRITEANYBIN WRITEBIN WRITEBLOCK WRITECFGDATA WRITERAWBYTES WRITESTRBIN STOPMOVE STARTMOVE STOPMOVERESET
"""
HARMLESS = frozenset(HARMLESS_TEXT.split())
"""Instructions that move nothing and set nothing that motions depend on (1, by their names)."""
ASIDE_NAMED = NOT_SIMULATED - {"CORRWRITE", "SYNCTOSENSOR"} | {"EOFFSOFF"}
"""Instructions that are named as not simulated: the arm itself goes where its targets say."""
PARAMETERS: Mapping[str, int] = {
    **{"OFFS": 4, "RELTOOL": 4, "POSEMULT": 2, "POSEINV": 1, "POSEVECT": 2, "ORIENTZYX": 3, "EULERZYX": 1},
    **{"NORIENT": 1, "DEFFRAME": 3, "DISTANCE": 2, "DOTPROD": 2, "VECTMAGN": 1, "CROBT": 0, "CJOINTT": 0, "CPOS": 0},
    **{"CTOOL": 0, "CWOBJ": 0, "CALCROBT": 2, "CALCJOINTT": 2, "ABS": 1, "SQRT": 1, "SIN": 1, "COS": 1, "TAN": 1},
    **{"ASIN": 1, "ACOS": 1, "ATAN": 1, "ATAN2": 2, "POW": 2, "EXP": 1, "TRUNC": 1, "ROUND": 1, "DIM": 2},
    **{"STRLEN": 1, "STRPART": 3, "STRMAP": 3, "NUMTOSTR": 2, "VALTOSTR": 1, "PRESENT": 1, "BITAND": 2, "BITOR": 2},
    **{"BITXOR": 2, "BITNEG": 1, "BITLSH": 2, "BITRSH": 2, "BITCHECK": 2},
    **{"MIRPOS": 2, "NUMTODNUM": 1, "DNUMTONUM": 1},
}
"""Functions that are evaluated, with the number of their arguments."""
ASKED_TEXT = """
AINPUT AOUTPUT DINPUT DOUTPUT GINPUT GOUTPUT TESTDI TESTANDSET CLKREAD CDATE CTIME GETTIME CSPEEDOVERRIDE ISPERS ISVAR
ISSTOPMOVEACT OPMODE RUNMODE ROBOS ROBNAME TASKRUNROB TASKRUNMEC GETTASKNAME GETMECUNITNAME GETNEXTMECHUNIT ISSYSID
ISMECHUNITACTIVE ISFILE FILESIZE FSSIZE READBIN READDIR READMOTOR READNUM READSTR READSTRBIN READVAR SOCKETGETSTATUS
SOCKETPEEK UIALPHAENTRY UICLIENTEXIST UIDNUMENTRY UIDNUMTUNE UILISTVIEW UIMESSAGEBOX
UINUMENTRY UINUMTUNE GETSIGNALORIGIN IOUNITSTATE VALIDIO EVENTTYPE EXECHANDLER EXECLEVEL MOTORTEMP
NONMOTIONMODE PATHLEVEL PPMOVEDINMANMODE RAWBYTESLEN RMQGETSLOTNAME TASKS TYPE TRIGGDATAVALID ARGNAME CSPEED
GETAXISDISTANCE GETMAXNUMBEROFCYCLICBOOL GETNEXTSYM GETSYSINFO GETMODALPAYLOADMODE
"""
ASKED = frozenset(ASKED_TEXT.split())
"""Functions whose value only the running cell knows."""
NOT_EVALUATED = frozenset(
    (
        *(
            "STRDIGCALC",
            "STRDIGCMP",
            "STRFIND",
            "STRFORMAT",
            "STRMATCH",
            "STRMEMB",
            "STRORDER",
            "STRTOBYTE",
            "STRTOVAL",
        ),
        *("BYTETOSTR", "DECTOHEX", "HEXTODEC"),
    )
)
"""Functions whose value follows from their arguments alone, and that are not evaluated."""


def is_known(name: str) -> bool:
    """Whether it is known of an instruction or function, which the program does not hold, what it does."""
    if name[:1] == "%" or name in SETTINGS or name in OUTPUTS or name in ("GRIPLOAD", "SETSYSDATA"):
        return True
    evaluated = name in PARAMETERS or name in NOT_EVALUATED
    return evaluated or name in HARMLESS or name in ASKED or name in ASIDE_NAMED or name in WAITS


def changed_arguments(call: syntax.Invocation) -> list[syntax.Expression | None]:
    """What a function of the controller changes of its arguments."""
    at = CHANGING_FUNCTIONS.get(call.function)
    by_name: list[syntax.Expression | None] = [each for key, each in call.keywords if key in CHANGING_OPTIONS]
    return by_name if at is None else [*call.arguments[at : at + 1], *by_name]


def perhaps_changed(call: syntax.Invocation, fixed: Container[str]) -> list[syntax.Expression]:
    """What a routine that is not in the program may change of its arguments, which it may have by reference.

    ``fixed``: names of constants, and of data that hardly any routine changes, such as tools.
    """
    if is_known(call.function) and call.function != LATE:
        return []
    given = (each for each in (*call.arguments, *(each for _, each in call.keywords)) if each is not None)
    return [each for each in given if (name := variable_of(each)) and name not in fixed]
