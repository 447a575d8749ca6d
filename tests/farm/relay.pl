# Between a worker and its coordinator, as somebody on the way would be (ZMTP 3, rfc.zeromq.org/spec/23).
#
#   perl relay.pl relay PORT FILE        listens on a free port of 127.0.0.1 and prints it; relays a connection to PORT,
#                                        and keeps in FILE what the worker said; then prints a line for each other one
#   perl relay.pl forge PORT FILE FRAME  does so, and flips the last bit of the worker's frame of that number (from 1,
#                                        behind the greeting); ends with the connection
#   perl relay.pl replay PORT FILE       says to PORT what was kept; ends with the connection
use strict;
use warnings;
use IO::Select;
use IO::Socket::INET;

my ($mode, $port, $file, $forged) = @ARGV;
$| = 1;
alarm 60; # whatever happens, this ends
$SIG{PIPE} = 'IGNORE'; # the end that goes is noticed by reading

# Takes the whole frames from the front of $$data, and forges the one of that number.
my $frame = 0;
sub take_frames {
    my ($data) = @_;
    my $taken = '';
    while (length $$data >= 2) {
        my $long = ord($$data) & 2; # the size has eight bytes
        last if $long && length $$data < 9;
        my $size = $long ? 9 + unpack('x Q>', $$data) : 2 + unpack('x C', $$data);
        last if length $$data < $size;
        my $whole = substr $$data, 0, $size, '';
        substr($whole, -1) ^= "\1" if ++$frame == ($forged // 0);
        $taken .= $whole;
    }
    return $taken;
}

sub keep {
    my ($said) = @_;
    open my $kept, '>', $file or die "cannot write $file: $!\n";
    binmode $kept;
    print $kept $said;
}

# The greeting comes in parts, each in answer to the other side's, and passes as it comes; frames pass whole.
sub relay {
    my ($worker, $coordinator) = @_;
    my $select = IO::Select->new($worker, $coordinator);
    my ($greeting, $waiting, $said) = (64, '', ''); # bytes that are still to come; a begun frame; all that passed
    while (1) {
        for my $from ($select->can_read) {
            $from->sysread(my $data, 65536) or return keep($said);
            if ($from == $worker) {
                my $passed = substr $data, 0, $greeting, '';
                $greeting -= length $passed;
                $waiting .= $data;
                $data = $passed . take_frames(\$waiting);
                $said .= $data;
            }
            my $to = $from == $worker ? $coordinator : $worker;
            $to->syswrite($data);
        }
    }
}

sub connect_to_port {
    return IO::Socket::INET->new(PeerAddr => '127.0.0.1', PeerPort => $port) // die "cannot connect: $!\n";
}

if ($mode ne 'replay') {
    my $server = IO::Socket::INET->new(LocalAddr => '127.0.0.1', Listen => 1) or die "cannot listen: $!\n";
    print $server->sockport, "\n";
    relay(scalar $server->accept, connect_to_port());
    while ($mode eq 'relay' && $server->accept) {
        print "another\n";
    }
    exit;
}
my $coordinator = connect_to_port();
open my $kept, '<', $file or die "cannot read $file: $!\n";
binmode $kept;
local $/;
$coordinator->syswrite(<$kept>);
1 while $coordinator->sysread(my $data, 65536);
