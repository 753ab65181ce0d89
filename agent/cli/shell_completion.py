"""Provide tab completion in bash, zsh and fish: `structagent completion`.

The script of each shell asks structagent for the candidates; nothing heavy is imported for that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from textwrap import shorten
from typing import Annotated

import typer

from agent.cli.command_tree import Command, Parameter, command_tree

_HELP = ("--help", "Show this message and exit.")
_MEANING = 70  # characters

# Each script passes the words up to the cursor. The first line of the answer says whether a path is legal there too
# ("files", "folders", otherwise "words"); every other line is a candidate: a word, a tab, and its meaning.
_BASH = """\
_structagent_completion() {
    local line word kind=
    COMPREPLY=()
    while IFS= read -r line; do
        if [[ -z $kind ]]; then
            kind=$line
        else
            printf -v word %q "${line%%$'\\t'*}"
            COMPREPLY+=("$word")
        fi
    done < <("$1" completion bash -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
    case $kind in
        files) compopt -o default ;;
        folders) compopt -o dirnames ;;
    esac
}
complete -F _structagent_completion structagent"""

_ZSH = """\
#compdef structagent
_structagent() {
    local line word kind=
    local -a offers
    for line in "${(@f)$(${words[1]} completion zsh -- "${(@Q)words[2,CURRENT]}" 2>/dev/null)}"; do
        if [[ -z $kind ]]; then
            kind=$line
        else
            word=${line%%$'\\t'*}
            offers+=("${word//:/\\\\:}:${line#*$'\\t'}")
        fi
    done
    (( $#offers )) && _describe structagent offers
    case $kind in
        files) _files ;;
        folders) _files -/ ;;
    esac
}
compdef _structagent structagent"""

_FISH = """\
function __structagent_completion
    set -l words (commandline -opc) (commandline -ct)
    set -l lines ($words[1] completion fish -- $words[2..-1] 2>/dev/null)
    if test (count $lines) -gt 1
        printf '%s\\n' $lines[2..-1]
    end
    switch "$lines[1]"
        case files
            __fish_complete_path (commandline -ct)
        case folders
            __fish_complete_directories (commandline -ct)
    end
end
complete --command structagent --no-files --arguments '(__structagent_completion)'"""


class Shell(StrEnum):
    """The supported shells."""

    bash = "bash"
    zsh = "zsh"
    fish = "fish"


_SCRIPTS = {Shell.bash: _BASH, Shell.zsh: _ZSH, Shell.fish: _FISH}


@dataclass(frozen=True)
class Offer:
    """Candidates for the word at the cursor.

    Attributes:
        words: each with its meaning.
        paths: `agent.cli.command_tree.FILES` or `FOLDERS` if a path is legal too, otherwise empty.
    """

    words: tuple[tuple[str, str], ...] = ()
    paths: str = ""


def offer(program: Command, words: Sequence[str]) -> Offer:
    """Return the candidates for the last word.

    Args:
        program: the commands.
        words: the command line after the name of the program, up to the cursor; the last may be empty. Bash splits
            "--seed=3" into three words.
    """
    *before, last = words or [""]
    if last == "=":
        last = ""
    command, waiting, used, arguments, only_arguments = program, None, set[str](), 0, False
    for word in before:
        if waiting is not None and word == "=":
            continue
        if waiting is not None:
            waiting = None
        elif word == "--":
            only_arguments = True
        elif word.startswith("-") and not only_arguments:
            option = _option(command, word.partition("=")[0])
            used.update(option.flags if option and not option.repeated else ())
            waiting = option if option and option.metavar and "=" not in word else None
        elif command.commands:
            if word not in command.commands:
                return Offer()
            command, used = command.commands[word], set()
        else:
            arguments += 1
    if waiting is not None:
        return _values(waiting, last)
    if last.startswith("-") and not only_arguments:
        flag, equals, value = last.partition("=")
        option = _option(command, flag)
        if equals:
            return _values(option, value, flag + equals) if option else Offer()
        return Offer(tuple(entry for entry in _flags(command, used) if entry[0].startswith(last)))
    if command.commands:
        inner = ((name, _short(each.help)) for name, each in command.commands.items())
        return Offer(tuple(entry for entry in inner if entry[0].startswith(last)))
    takes = [parameter for parameter in command.parameters if not parameter.flags]
    if arguments < len(takes) or (takes and takes[-1].repeated):
        return _values(takes[min(arguments, len(takes) - 1)], last)
    return Offer()


def _option(command: Command, flag: str) -> Parameter | None:
    return next((parameter for parameter in command.parameters if flag in parameter.flags), None)


def _flags(command: Command, used: set[str]) -> list[tuple[str, str]]:
    flags = [(flag, each.help) for each in command.parameters for flag in each.flags if flag not in used]
    return [*flags, _HELP]


def _values(parameter: Parameter, begun: str, prefix: str = "") -> Offer:
    words = tuple((prefix + value, parameter.help) for value in parameter.values if value.startswith(begun))
    return Offer(words, parameter.paths)


def _short(text: str) -> str:
    """Return the first sentence."""
    return " ".join(text.partition("\n\n")[0].split()).partition(";")[0].rstrip(".")


def completion(
    ctx: typer.Context,
    shell: Annotated[Shell, typer.Argument(metavar="|".join(Shell), help="Shell to complete in.", show_default=False)],
    words: Annotated[
        list[str] | None,
        typer.Argument(metavar="WORD", help="Words of the command line so far; given by the script itself."),
    ] = None,
) -> None:
    """Print a script for tab completion.

    It completes commands, options and their values. For bash and zsh, add `source <(structagent completion bash)`, with
    the name of the shell, to ~/.bashrc or ~/.zshrc. For fish, write the output to
    ~/.config/fish/completions/structagent.fish.

    Example: structagent completion bash
    """
    if not words:
        print(_SCRIPTS[shell])
        return
    offered = offer(command_tree(ctx.find_root().command), words)
    print(offered.paths or "words")
    for word, meaning in offered.words:
        print(f"{word}\t{shorten(meaning, _MEANING, placeholder=' …')}")
