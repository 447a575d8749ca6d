# A TCP proxy that does to connections what networks do, at random. Prints the port of 127.0.0.1 where it listens, and
# then a line for each thing done. Ends when it is told to, or after ten minutes.
#
#   perl proxy.pl HOST:PORT SEED [delay=MS] [stall=SHARE:MS] [cut=SHARE] [corrupt=SHARE]
#
# delay: each direction of each connection is late by a time of its own, up to MS, so that what connections say
#        arrives in another order; stall: so much of what passes, 0..1, holds up its direction for MS; cut: resets the
#        connection instead; corrupt: changes one bit.
use strict;
use warnings;
use IO::Select;
use IO::Socket::INET;
use Socket qw(SOL_SOCKET SO_LINGER);
use Time::HiRes qw(time);

my ($target, $seed, @faults) = @ARGV;
my %fault = (delay => 0, stall => '0:0', cut => 0, corrupt => 0, map { split /=/, $_, 2 } @faults);
my ($stall_share, $stall_ms) = split /:/, $fault{stall};
srand $seed;
$| = 1;
alarm 600;
$SIG{PIPE} = 'IGNORE'; # the end that goes is noticed by reading

my $server = IO::Socket::INET->new(LocalAddr => '127.0.0.1', Listen => 100, Blocking => 0) or die "cannot listen: $!\n";
my %direction; # by the socket that is read: {from, to, late (seconds), queue of [when, bytes]}
print $server->sockport, "\n";

sub open_connection {
    my $near = $server->accept or return;
    my $far = IO::Socket::INET->new(PeerAddr => $target, Timeout => 5) or return; # $near is closed: none is there
    $_->blocking(0) for $near, $far;
    for ([$near, $far], [$far, $near]) {
        my ($from, $to) = @$_;
        $direction{$from} = {from => $from, to => $to, late => rand($fault{delay}) / 1000, queue => []};
    }
}

sub close_connection {
    my ($way, $reset) = @_;
    for my $socket ($way->{from}, $way->{to}) {
        setsockopt $socket, SOL_SOCKET, SO_LINGER, pack 'ii', 1, 0 if $reset;
        delete $direction{$socket};
        close $socket;
    }
}

sub take {
    my ($way) = @_;
    my $got = $way->{from}->sysread(my $data, 16384);
    return if !defined $got && $!{EAGAIN};
    return close_connection($way, 0) if !$got;
    if (rand() < $fault{cut}) {
        print "cut\n";
        return close_connection($way, 1);
    }
    if (rand() < $fault{corrupt}) {
        print "corrupted\n";
        vec($data, int rand 8 * length $data, 1) ^= 1;
    }
    my $queue = $way->{queue};
    my $when = time + $way->{late};
    if (rand() < $stall_share) {
        print "stalled\n";
        $when += $stall_ms / 1000;
    }
    $when = $queue->[-1][0] if @$queue && $queue->[-1][0] > $when; # in one direction the order stays
    push @$queue, [$when, $data];
}

# What is due; the rest of what does not fit yet waits for the next turn.
sub give {
    my ($way) = @_;
    my $queue = $way->{queue};
    while (@$queue && $queue->[0][0] <= time) {
        my $sent = $way->{to}->syswrite($queue->[0][1]);
        return close_connection($way, 0) if !defined $sent && !$!{EAGAIN};
        substr $queue->[0][1], 0, $sent // 0, '';
        return $queue->[0][0] = time + 0.005 if length $queue->[0][1];
        shift @$queue;
    }
}

while (1) {
    my ($soonest) = sort { $a <=> $b } map { $_->{queue}[0][0] } grep { @{$_->{queue}} } values %direction;
    my $wait = defined $soonest ? $soonest - time : 60;
    my $select = IO::Select->new($server, map { $_->{from} } values %direction);
    for my $socket ($select->can_read($wait > 0 ? $wait : 0)) {
        if ($socket == $server) {
            open_connection();
        } elsif ($direction{$socket}) { # still: its other end may have closed it just now
            take($direction{$socket});
        }
    }
    for my $way (values %direction) {
        give($way) if $direction{$way->{from}};
    }
}
